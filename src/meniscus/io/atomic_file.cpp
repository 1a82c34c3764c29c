#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

namespace meniscus::io {
namespace {

constexpr std::size_t kBufferSize = 1 << 20;

FileCalls& real_calls() {
  static FileCalls calls;
  return calls;
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == path.npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

std::string hidden_sibling(const std::string& path) {
  static std::atomic<unsigned> serial{0};
  const std::size_t slash = path.rfind('/');
  const std::size_t name = slash == path.npos ? 0 : slash + 1;
  // Long names are cut: the sibling's name must fit the same limit as the file's.
  return path.substr(0, name) + "." + path.substr(name, 200) + "." + std::to_string(::getpid()) + "-" +
         std::to_string(serial++) + ".tmp";
}

}  // namespace

int FileCalls::create(const char* path) { return ::open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666); }
long FileCalls::write(int file, const char* data, std::size_t size) { return ::write(file, data, size); }
int FileCalls::sync(int file) { return ::fsync(file); }
int FileCalls::close(int file) { return ::close(file); }
int FileCalls::remove(const char* path) { return ::unlink(path); }

int FileCalls::rename(const char* from, const char* to, bool replace) {
  if (replace) return ::rename(from, to);
  const int done = ::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE);
  if (done == 0 || (errno != EINVAL && errno != ENOSYS)) return done;
  // A file system without that flag: look, then rename.
  struct stat status {};
  if (::lstat(to, &status) == 0) {
    errno = EEXIST;
    return -1;
  }
  return ::rename(from, to);
}

int FileCalls::sync_folder(const char* path) {
  const int folder = ::open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return -1;
  const int done = ::fsync(folder);
  const int error = errno;
  ::close(folder);
  errno = error;
  // Some file systems cannot sync folders; the rename itself has succeeded.
  return done != 0 && error == EINVAL ? 0 : done;
}

AtomicFile::AtomicFile(std::string path, const WriteOptions& options)
    : path_(std::move(path)),
      target_(path_),
      replace_(options.overwrite),
      calls_(options.calls != nullptr ? *options.calls : real_calls()) {
  buffer_.reserve(kBufferSize);
  if (path_ == "-") {
    file_ = STDOUT_FILENO;
    return;
  }
  std::error_code error;
  const auto status = std::filesystem::status(path_, error);
  if (std::filesystem::is_directory(status)) fail("write", EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    open_direct();
    return;
  }
  if (std::filesystem::exists(status) && !replace_) fail("write", EEXIST);
  if (std::filesystem::is_symlink(std::filesystem::symlink_status(path_, error))) {
    const auto resolved = std::filesystem::weakly_canonical(path_, error);
    if (!error) target_ = resolved.string();
  }
  open_sibling();
}

void AtomicFile::open_direct() {
  file_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  if (file_ < 0) fail("write", errno);
}

void AtomicFile::open_sibling() {
  temporary_ = hidden_sibling(target_);
  file_ = calls_.create(temporary_.c_str());
  if (file_ >= 0) return;
  const int error = errno;
  temporary_.clear();
  fail("write", error);
}

AtomicFile::~AtomicFile() {
  if (file_ > STDERR_FILENO) calls_.close(file_);
  if (!temporary_.empty()) calls_.remove(temporary_.c_str());
}

void AtomicFile::write(std::string_view data) {
  if (buffer_.size() + data.size() > kBufferSize) flush();
  if (data.size() <= kBufferSize) {
    buffer_.insert(buffer_.end(), data.begin(), data.end());
    return;
  }
  for (; data.size() > kBufferSize; data.remove_prefix(kBufferSize)) {
    buffer_.assign(data.begin(), data.begin() + kBufferSize);
    flush();
  }
  buffer_.assign(data.begin(), data.end());
}

namespace {
template <class T>
std::string_view decimal(T value, char (&text)[40]) {
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return {text, static_cast<std::size_t>(end - text)};
}
}  // namespace

void AtomicFile::number(double value) {
  char text[40];
  write(decimal(value, text));
}

void AtomicFile::number(float value) {
  char text[40];
  write(decimal(value, text));
}

void AtomicFile::number(std::int64_t value) {
  char text[40];
  write(decimal(value, text));
}

void AtomicFile::flush() {
  for (std::size_t done = 0; done < buffer_.size();) {
    const long written = calls_.write(file_, buffer_.data() + done, buffer_.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("write", errno);
    done += static_cast<std::size_t>(written);
  }
  buffer_.clear();
}

void AtomicFile::commit() {
  flush();
  if (temporary_.empty()) {
    if (file_ > STDERR_FILENO) {
      const int file = std::exchange(file_, -1);
      if (calls_.close(file) != 0) fail("close", errno);
    }
    return;
  }
  if (calls_.sync(file_) != 0) fail("sync", errno);
  const int file = std::exchange(file_, -1);
  if (calls_.close(file) != 0) fail("close", errno);
  if (calls_.rename(temporary_.c_str(), target_.c_str(), replace_) != 0) fail("rename into place", errno);
  temporary_.clear();
  if (calls_.sync_folder(folder_of(target_).c_str()) != 0) fail("sync the folder of", errno);
}

void AtomicFile::fail(const char* action, int error) {
  std::string reason = std::string("cannot ") + action + ": ";
  if (error == EEXIST)
    reason += "the file exists (overwrite it with --force)";
  else if (error == ENOENT)
    reason += "the folder '" + folder_of(path_) + "' does not exist";
  else
    reason += std::generic_category().message(error);
  throw IoError(path_, reason, {}, IoError::Kind::Write);
}

void write_file(const std::string& path, std::string_view content, const WriteOptions& options) {
  AtomicFile file(path, options);
  file.write(content);
  file.commit();
}

}  // namespace meniscus::io
