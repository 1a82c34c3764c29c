#include "cli.h"

#include <meniscus/scene/schema.h>
#include <meniscus/scene/sculpt_script.h>

#include <memory>

namespace meniscus::cli {

void add_schema(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("schema",
                                      "Print the JSON schema of scene files or sculpting scripts.\n\n"
                                      "Example: meniscus schema > meniscus.schema.json");
  auto kind = std::make_shared<std::string>("scene");
  verb->add_option("kind", *kind, "scene (default) or sculpt")->check(CLI::IsMember({"scene", "sculpt"}));
  session.add_common(*verb);
  verb->callback(
      [&session, kind] { session.print(std::string(*kind == "scene" ? scene::scene_schema() : scene::sculpt_schema())); });
}

}  // namespace meniscus::cli
