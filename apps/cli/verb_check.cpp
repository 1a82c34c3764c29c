#include "cli.h"

#include <meniscus/mesh/validate.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

void check(const std::vector<std::string>& paths, Session& session) {
  const RunControl control = session.run();
  session.report()["check"] = nlohmann::json::array();
  // A pattern stands for every file that fits it.
  std::vector<std::string> files;
  for (const std::string& p : paths) {
    const auto pattern = io::FramePattern::parse(p);
    if (!pattern) {
      files.push_back(p);
      continue;
    }
    const auto there = pattern->existing();
    if (there.empty()) throw IoError(p, "no file fits the pattern");
    for (const io::FrameFile& f : there) files.push_back(f.path);
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    control.check();
    control.progress(static_cast<double>(i) / static_cast<double>(files.size()), "check");
    session.add_input(files[i]);
    const mesh::Mesh mesh = io::read_mesh(files[i]);
    const mesh::Audit audit = mesh::validate(mesh);
    const std::string line = mesh::summary(audit);
    session.report()["check"].push_back({{"path", files[i]},
                                         {"good", audit.good()},
                                         {"closed", audit.closed()},
                                         {"manifold", audit.manifold()},
                                         {"oriented", audit.oriented()},
                                         {"finite", audit.finite()},
                                         {"components", audit.components},
                                         {"euler", audit.euler},
                                         {"summary", line}});
    session.print(fmt::format("{}: {}\n", files[i], line));
    if (!audit.good()) session.fail_check(files[i] + ": " + line);
  }
  control.progress(1);
}

}  // namespace

void add_check(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("check",
                                      "Verify meshes: closed, manifold, oriented, finite. Exit code 5 when not.\n\n"
                                      "Example: meniscus check skin.####.ply");
  auto paths = std::make_shared<std::vector<std::string>>();
  verb->add_option("file", *paths, "mesh files, or a pattern for a sequence")->required();
  session.add_common(*verb);
  verb->callback([paths, &session] { check(*paths, session); });
}

}  // namespace meniscus::cli
