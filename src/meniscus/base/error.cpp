#include <meniscus/base/error.h>

namespace meniscus {
namespace {

std::string describe(const std::string& path, const std::string& reason, FilePlace place) {
  switch (place.kind) {
    case FilePlace::Kind::Line: return path + ":" + std::to_string(place.number) + ": " + reason;
    case FilePlace::Kind::Byte: return path + ": byte " + std::to_string(place.number) + ": " + reason;
    case FilePlace::Kind::None: break;
  }
  return path + ": " + reason;
}

}  // namespace

IoError::IoError(std::string path, const std::string& reason, FilePlace place, Kind kind)
    : Error(describe(path, reason, place)), path_(std::move(path)), place_(place), kind_(kind) {}

}  // namespace meniscus
