#include "cli.h"

#include <meniscus/scene/schema.h>

namespace meniscus::cli {

void add_schema(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("schema",
                                      "Print the JSON schema of scene files.\n\n"
                                      "Example: meniscus schema > meniscus.schema.json");
  session.add_common(*verb);
  verb->callback([&session] { session.print(std::string(scene::scene_schema())); });
}

}  // namespace meniscus::cli
