#pragma once

// One libFuzzer target a reader; CMake does not build them. From the root of the repository, with clang (for ply):
//
//   clang++ -std=c++20 -g -O1 -fsanitize=fuzzer,address,undefined -Isrc -isystem /usr/include/eigen3 tests/fuzz/ply.cpp
//       $(ls src/meniscus/{base,field,mesh,points,pointset,io}/*.cpp | grep -v vdb) -ltbb -lz -o /tmp/fuzz_ply
//   /tmp/fuzz_ply -max_len=4096 -rss_limit_mb=2048 -timeout=5
//
// What a run finds becomes a line in tests/io/samples.h or a test beside it.

#include <meniscus/base/error.h>
#include <meniscus/io/geometry.h>

#include <cstddef>
#include <cstdint>

namespace meniscus::io {

/// Reads the bytes as a file of that name; a result and a typed error are both fine.
inline int fuzz_read(const char* name, const std::uint8_t* data, std::size_t size) {
  ReadOptions options;
  options.memory_limit = 64 << 20;
  try {
    const Geometry g = read_geometry_bytes(name, {reinterpret_cast<const char*>(data), size}, options);
    static_cast<void>(g);
  } catch (const Error&) {
  }
  return 0;
}

}  // namespace meniscus::io
