#include <meniscus/base/error.h>
#include <meniscus/io/file_bytes.h>

#include <zlib.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>
#include <vector>

namespace meniscus::io {
namespace {

/// Small files may be all zeros; only large ones can hurt.
constexpr std::uint64_t kFreeInflation = 64ull << 20;
constexpr std::uint64_t kLargestRatio = 400;
constexpr std::uint64_t kLargestInput = 8ull << 30;  // standard input

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { ::close(fd_); }
  int get() const { return fd_; }

 private:
  int fd_;
};

[[noreturn]] void fail(const std::string& path, int error) {
  throw IoError(path, "cannot read: " + std::generic_category().message(error));
}

void check_limit(std::uint64_t bytes, const std::string& path, std::uint64_t limit) {
  if (bytes > limit)
    throw ResourceLimit(path + ": more than " + std::to_string(limit) + " bytes, the memory limit for reading");
}

/// read() that continues after interrupts.
std::size_t read_some(int file, char* to, std::size_t size, const std::string& path) {
  for (;;) {
    const ssize_t got = ::read(file, to, size);
    if (got >= 0) return static_cast<std::size_t>(got);
    if (errno != EINTR) fail(path, errno);
  }
}

/// All of standard input, in memory: a pipe can be read once, but the kind of input is told before it is read.
int spooled_input() {
  const int spool = ::memfd_create("input", MFD_CLOEXEC);
  if (spool < 0) fail("-", errno);
  std::vector<char> piece(1 << 20);
  std::uint64_t size = 0;
  while (const std::size_t got = read_some(STDIN_FILENO, piece.data(), piece.size(), "-")) {
    check_limit(size += got, "-", kLargestInput);
    for (std::size_t written = 0; written < got;) {
      const ssize_t n = ::write(spool, piece.data() + written, got - written);
      if (n < 0 && errno != EINTR) fail("-", errno);
      written += static_cast<std::size_t>(std::max<ssize_t>(n, 0));
    }
  }
  return spool;
}

/// Opened for reading from its beginning; throws for what is missing or a folder.
int open_file(const std::string& path) {
  std::string name = path;
  if (path == "-") {
    static const int spool = spooled_input();
    name = "/proc/self/fd/" + std::to_string(spool);
  }
  const int file = ::open(name.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) fail(path, errno);
  return file;
}

std::string read_all(const std::string& path, std::uint64_t limit) {
  const Descriptor file(open_file(path));
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) fail(path, errno);
  if (S_ISDIR(status.st_mode)) fail(path, EISDIR);
  const auto size = static_cast<std::uint64_t>(std::max<off_t>(status.st_size, 0));
  check_limit(size, path, limit);

  // One byte more than the file claims, so that its end shows without a second buffer. Pipes claim nothing.
  std::string bytes(std::max<std::size_t>(size + 1, 1 << 16), '\0');
  std::size_t filled = 0;
  for (;;) {
    const std::size_t got = read_some(file.get(), bytes.data() + filled, bytes.size() - filled, path);
    if (got == 0) break;
    filled += got;
    check_limit(filled, path, limit);
    if (filled == bytes.size()) bytes.resize(2 * bytes.size());
  }
  bytes.resize(filled);
  return bytes;
}

}  // namespace

bool is_gzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b"); }

std::string inflate_gzip(std::string_view bytes, const std::string& path, std::uint64_t limit) {
  z_stream stream{};
  constexpr int kGzipOnly = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzipOnly) != Z_OK) throw ResourceLimit(path + ": no memory to inflate");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> guard(&stream, inflateEnd);

  const std::uint64_t allowed = std::min(limit, std::max(kFreeInflation, kLargestRatio * bytes.size()));
  std::string out;
  std::string chunk(1 << 18, '\0');
  std::size_t consumed = 0;
  for (;;) {
    if (stream.avail_in == 0) {
      const std::size_t n = std::min<std::size_t>(bytes.size() - consumed, 1u << 30);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + consumed));
      stream.avail_in = static_cast<uInt>(n);
      consumed += n;
    }
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    const int status = inflate(&stream, Z_NO_FLUSH);
    const std::size_t position = consumed - stream.avail_in;
    if (status != Z_OK && status != Z_STREAM_END)
      throw IoError(path, position == bytes.size() ? "the gzip data end early" : "broken gzip data",
                    FilePlace::byte(position));
    out.append(chunk.data(), chunk.size() - stream.avail_out);
    if (out.size() > allowed)
      throw ResourceLimit(path + ": gzip data inflate to more than " + std::to_string(allowed) + " bytes");
    if (status == Z_STREAM_END) {
      // Another member may follow; anything else (padding) is ignored, as gzip does.
      if (!is_gzip(bytes.substr(position))) return out;
      if (inflateReset(&stream) != Z_OK) throw IoError(path, "broken gzip data", FilePlace::byte(position));
    }
  }
}

bool begins_with_gzip(const std::string& path) {
  const Descriptor file(open_file(path));
  char head[2] = {};
  return read_some(file.get(), head, sizeof head, path) == sizeof head && is_gzip({head, sizeof head});
}

std::uint64_t scan_file(const std::string& path, std::string_view mark, std::vector<std::uint64_t>& positions) {
  const Descriptor file(open_file(path));
  std::string piece(4 << 20, '\n');
  std::uint64_t piece_start = 0;  // position in the file of piece[keep]
  // The end of the last piece stays in front of the next one, so a mark on the border is seen whole; the file starts as if
  // after a line end.
  const std::size_t keep = mark.size() + 1;
  for (;;) {
    const std::size_t got = read_some(file.get(), piece.data() + keep, piece.size() - keep, path);
    if (got == 0) return piece_start;
    const std::string_view seen(piece.data(), keep + got);
    for (std::size_t at = seen.find(mark); at != seen.npos; at = seen.find(mark, at + 1)) {
      if (at + mark.size() <= keep) continue;  // was seen whole the last time
      const std::uint64_t position = piece_start + at - keep;
      const bool after_byte_order_mark = position == 3 && seen.substr(at - 3, 3) == "\xEF\xBB\xBF";
      if (seen[at - 1] == '\n' || seen[at - 1] == '\r' || after_byte_order_mark) positions.push_back(position);
    }
    piece_start += got;
    std::copy_n(piece.begin() + static_cast<std::ptrdiff_t>(got), keep, piece.begin());
  }
}

std::string load_part(const std::string& path, std::uint64_t begin, std::uint64_t size, std::uint64_t limit) {
  check_limit(size, path, limit);
  const Descriptor file(open_file(path));
  if (::lseek(file.get(), static_cast<off_t>(begin), SEEK_SET) < 0) fail(path, errno);
  std::string bytes(static_cast<std::size_t>(size), '\0');
  for (std::size_t filled = 0; filled < bytes.size();) {
    const std::size_t got = read_some(file.get(), bytes.data() + filled, bytes.size() - filled, path);
    if (got == 0) throw IoError(path, "the file became shorter while it was read");
    filled += got;
  }
  return bytes;
}

std::string load_plain_file(const std::string& path, std::uint64_t limit) { return read_all(path, limit); }

std::string load_file(const std::string& path, std::uint64_t limit) {
  std::string bytes = read_all(path, limit);
  return is_gzip(bytes) ? inflate_gzip(bytes, path, limit) : bytes;
}

}  // namespace meniscus::io
