#pragma once

#include "support/scratch.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include <sys/wait.h>

namespace meniscus::test {

struct Ran {
  int code = -1;
  std::string out;
  std::string err;
};

inline std::string contents(const std::string& path) {
  std::ifstream f(path, std::ios::binary);
  std::ostringstream s;
  s << f.rdbuf();
  return s.str();
}

/// Runs the built program with a shell's line of arguments. `before` may set variables, or end in a pipe into the program.
inline Ran meniscus_program(const std::string& arguments, const std::string& before = "") {
  const Scratch scratch;
  const std::string line = before + " '" MENISCUS_BINARY_DIR "/bin/meniscus' " + arguments + " >'" + (scratch / "out") +
                           "' 2>'" + (scratch / "err") + (before.ends_with("|") ? "'" : "' </dev/null");
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contents(scratch / "out"),
          contents(scratch / "err")};
}

}  // namespace meniscus::test
