#pragma once

#include <meniscus/io/geometry.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::io {

/// The calls to the operating system that writing a file needs; they behave like POSIX: -1 and errno on failure.
/// Tests pass an implementation that fails on purpose.
class FileCalls {
 public:
  virtual ~FileCalls() = default;
  virtual int create(const char* path);  ///< a new file for writing; EEXIST if it is there
  virtual long write(int file, const char* data, std::size_t size);
  virtual int sync(int file);
  virtual int close(int file);
  virtual int rename(const char* from, const char* to, bool replace);  ///< EEXIST if `to` is there and not to be replaced
  virtual int sync_folder(const char* path);
  virtual int remove(const char* path);
};

/// A file that appears complete or not at all.
///
/// Writes go to a hidden sibling in the same folder; commit() writes out what is left, syncs it, renames it into place and
/// syncs the folder. Without commit() (an exception, say) the sibling is removed and an older file of that name stays as it
/// was. A symbolic link is followed; "-" (standard output) and devices are written directly. Every failure is an IoError of
/// kind Write with the path and the system's reason.
class AtomicFile {
 public:
  /// Fails early when the file exists and `options.overwrite` is off, when the folder is missing or may not be written.
  AtomicFile(std::string path, const WriteOptions& options);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  void write(std::string_view data);
  void put(char c) { write({&c, 1}); }
  /// The shortest decimal form that reads back as the same number.
  void number(double value);
  void number(float value);
  void number(std::int64_t value);

  void commit();

 private:
  [[noreturn]] void fail(const char* action, int error);
  void flush();
  void open_direct();
  void open_sibling();

  std::string path_;       ///< as the user gave it, for messages
  std::string target_;     ///< with a symbolic link resolved
  std::string temporary_;  ///< empty when written directly
  bool replace_;
  FileCalls& calls_;
  int file_ = -1;
  std::vector<char> buffer_;
};

/// Writes a small file whole.
void write_file(const std::string& path, std::string_view content, const WriteOptions& options);

}  // namespace meniscus::io
