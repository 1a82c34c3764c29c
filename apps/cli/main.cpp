#include "cli.h"

#include <meniscus/base/suggest.h>

#include <fmt/format.h>

#include <new>

namespace meniscus::cli {

using AddVerb = void (*)(CLI::App& app, Session& session);

void add_info(CLI::App& app, Session& session);
void add_mesh(CLI::App& app, Session& session);
void add_sample(CLI::App& app, Session& session);
void add_render(CLI::App& app, Session& session);
void add_skin(CLI::App& app, Session& session);
void add_morph(CLI::App& app, Session& session);
void add_track(CLI::App& app, Session& session);
void add_convert(CLI::App& app, Session& session);
void add_edit(CLI::App& app, Session& session);
void add_sculpt(CLI::App& app, Session& session);
void add_check(CLI::App& app, Session& session);
void add_schema(CLI::App& app, Session& session);
void add_completion(CLI::App& app, Session& session);
void add_fit(CLI::App& app, Session& session);
void add_boolean(CLI::App& app, Session& session);

namespace {

constexpr AddVerb kVerbs[] = {add_info,    add_sample,  add_mesh,  add_track,  add_render,
                              add_skin,    add_morph,   add_edit,  add_fit,    add_sculpt,
                              add_boolean, add_convert, add_check, add_schema, add_completion};

/// What the parser did not understand, with the word that was probably meant.
std::string explain(const CLI::App& app, const CLI::ParseError& e, int argc, char** argv) {
  std::vector<std::string> names;
  const CLI::App* verb = nullptr;
  for (const CLI::App* sub : app.get_subcommands({})) {
    if (sub->parsed()) verb = sub;
    names.push_back(sub->get_name());
  }
  if (verb != nullptr) {
    names.clear();
    for (const CLI::Option* o : verb->get_options())
      for (const std::string& l : o->get_lnames()) names.push_back("--" + l);
  }
  const std::vector<std::string_view> views(names.begin(), names.end());
  for (int i = 1; i < argc; ++i) {
    std::string word = argv[i];
    word = word.substr(0, word.find('='));
    const bool candidate = verb != nullptr ? word.starts_with("--") : i == 1 && !word.starts_with("-");
    if (!candidate || std::find(names.begin(), names.end(), word) != names.end()) continue;
    return fmt::format("unknown {} '{}'{}", verb != nullptr ? "option" : "verb", word, did_you_mean(word, views));
  }
  return e.what();
}

int run(CLI::App& app, Session& session, int argc, char** argv) {
  std::string verb;
  try {
    app.parse(argc, argv);
    return session.finish("", kOk, "");
  } catch (const CLI::CallForHelp&) {
    const auto parsed = app.get_subcommands();
    fmt::print("{}", parsed.empty() ? app.help() : parsed[0]->help());
    return kOk;
  } catch (const CLI::CallForVersion&) {
    fmt::print("meniscus {}\n", MENISCUS_VERSION);
    return kOk;
  } catch (const CLI::ParseError& e) {
    const auto parsed = app.get_subcommands();
    const std::string name = parsed.empty() ? "" : parsed[0]->get_name();
    const std::string help = "\ntry: meniscus " + (name.empty() ? "" : name + " ") + "--help";
    return session.finish(name, kUsage, explain(app, e, argc, argv) + help);
  } catch (const std::exception& error) {
    const auto parsed = app.get_subcommands();
    if (!parsed.empty()) verb = parsed[0]->get_name();
    if (dynamic_cast<const Cancelled*>(&error) != nullptr) return session.finish(verb, kInterrupted, "cancelled");
    if (dynamic_cast<const UsageError*>(&error) != nullptr) return session.finish(verb, kUsage, error.what());
    if (const auto* io = dynamic_cast<const IoError*>(&error))
      return session.finish(verb, io->kind() == IoError::Kind::Write ? kOutput : kInput, error.what());
    if (dynamic_cast<const InvalidInput*>(&error) != nullptr) return session.finish(verb, kInput, error.what());
    if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return session.finish(verb, kFailed, "out of memory");
    return session.finish(verb, kFailed, error.what());
  }
}

}  // namespace
}  // namespace meniscus::cli

int main(int argc, char** argv) {
  using namespace meniscus::cli;
  CLI::App app{"meniscus: implicit surfaces that move\n\nExample: meniscus mesh drops.ply --radius 0.8 -o drops.obj",
               "meniscus"};
  app.set_version_flag("--version", MENISCUS_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  Session session;
  session.start(argc, argv);
  for (const AddVerb add : kVerbs) add(app, session);
  return run(app, session, argc, argv);
}
