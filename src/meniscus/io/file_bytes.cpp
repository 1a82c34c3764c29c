#include <meniscus/base/error.h>
#include <meniscus/io/file_bytes.h>

#include <zlib.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>

namespace meniscus::io {
namespace {

/// Small files may be all zeros; only large ones can hurt.
constexpr std::uint64_t kFreeInflation = 64ull << 20;
constexpr std::uint64_t kLargestRatio = 400;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ > STDERR_FILENO) ::close(fd_);
  }
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

std::string read_all(const std::string& path, std::uint64_t limit) {
  const Descriptor file(path == "-" ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) fail(path, errno);
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) fail(path, errno);
  if (S_ISDIR(status.st_mode)) fail(path, EISDIR);
  const auto size = static_cast<std::uint64_t>(std::max<off_t>(status.st_size, 0));
  check_limit(size, path, limit);

  // One byte more than the file claims, so that its end shows without a second buffer. Pipes claim nothing.
  std::string bytes(std::max<std::size_t>(size + 1, 1 << 16), '\0');
  std::size_t filled = 0;
  for (;;) {
    const ssize_t got = ::read(file.get(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(path, errno);
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
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

std::string load_file(const std::string& path, std::uint64_t limit) {
  std::string bytes = read_all(path, limit);
  return is_gzip(bytes) ? inflate_gzip(bytes, path, limit) : bytes;
}

}  // namespace meniscus::io
