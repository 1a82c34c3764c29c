#include "read.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return meniscus::io::fuzz_read("a.msurf", data, size);
}
