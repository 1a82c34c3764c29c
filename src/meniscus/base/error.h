#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace meniscus {

/// Base of every exception that meniscus throws. Messages name the fact and the place, and a remedy where one exists.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller passed something that has no meaning (negative spacing, NaN, unknown name).
class InvalidInput : public Error {
 public:
  using Error::Error;
};

/// The answer would need more memory, triangles or particles than allowed; the message carries the figure.
class ResourceLimit : public Error {
 public:
  using Error::Error;
};

/// RunControl::cancel() was called.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

/// Where in a file something is wrong: a line (text) or a byte offset (binary).
struct FilePlace {
  enum class Kind { None, Line, Byte };
  Kind kind = Kind::None;
  std::uint64_t number = 0;

  static FilePlace line(std::uint64_t n) { return {Kind::Line, n}; }
  static FilePlace byte(std::uint64_t n) { return {Kind::Byte, n}; }
};

/// A file could not be read or written. what() reads "path:LINE: reason" or "path: byte N: reason".
class IoError : public Error {
 public:
  enum class Kind { Read, Write };

  IoError(std::string path, const std::string& reason, FilePlace place = {}, Kind kind = Kind::Read);

  const std::string& path() const { return path_; }
  FilePlace place() const { return place_; }
  Kind kind() const { return kind_; }

 private:
  std::string path_;
  FilePlace place_;
  Kind kind_;
};

}  // namespace meniscus
