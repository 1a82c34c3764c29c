#include "cli.h"

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

struct Verb {
  std::string name;
  std::string about;
  std::vector<std::string> options;
};

std::vector<Verb> verbs_of(const CLI::App& app) {
  std::vector<Verb> verbs;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    Verb v{sub->get_name(), sub->get_description(), {}};
    v.about = v.about.substr(0, v.about.find('\n'));
    for (const CLI::Option* o : sub->get_options())
      for (const std::string& l : o->get_lnames()) v.options.push_back("--" + l);
    verbs.push_back(std::move(v));
  }
  return verbs;
}

std::string bash(const std::vector<Verb>& verbs) {
  std::string names, cases;
  for (const Verb& v : verbs) {
    names += v.name + " ";
    cases += fmt::format("    {}) words=\"{}\" ;;\n", v.name, fmt::join(v.options, " "));
  }
  return fmt::format(
      "_meniscus() {{\n  local current=\"${{COMP_WORDS[COMP_CWORD]}}\" words=\"\"\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then words=\"{}\"; else case \"${{COMP_WORDS[1]}}\" in\n{}  esac; fi\n"
      "  case \"$current\" in\n    -*) COMPREPLY=($(compgen -W \"$words\" -- \"$current\")) ;;\n"
      "    *) if [ \"$COMP_CWORD\" -eq 1 ]; then COMPREPLY=($(compgen -W \"$words\" -- \"$current\")); "
      "else COMPREPLY=($(compgen -f -- \"$current\")); fi ;;\n  esac\n}}\ncomplete -o filenames -F _meniscus meniscus\n",
      names, cases);
}

std::string zsh(const std::vector<Verb>& verbs) {
  return "#compdef meniscus\nautoload -U bashcompinit && bashcompinit\n" + bash(verbs);
}

std::string fish(const std::vector<Verb>& verbs) {
  std::string out;
  for (const Verb& v : verbs) {
    std::string about = v.about;
    for (std::size_t i = about.find('\''); i != std::string::npos; i = about.find('\'', i + 2)) about.replace(i, 1, "\\'");
    out += fmt::format("complete -c meniscus -n __fish_use_subcommand -a {} -d '{}'\n", v.name, about);
    for (const std::string& o : v.options)
      out += fmt::format("complete -c meniscus -n '__fish_seen_subcommand_from {}' -l {}\n", v.name, o.substr(2));
  }
  return out;
}

}  // namespace

void add_completion(CLI::App& app, Session& session) {
  CLI::App* verb =
      app.add_subcommand("completion",
                         "Print a completion script for bash, zsh or fish.\n\n"
                         "Example: meniscus completion bash > ~/.local/share/bash-completion/completions/meniscus");
  auto shell = std::make_shared<std::string>();
  verb->add_option("shell", *shell, "bash, zsh or fish")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  session.add_common(*verb);
  verb->callback([shell, &app, &session] {
    const auto verbs = verbs_of(app);
    session.print(*shell == "bash" ? bash(verbs) : *shell == "zsh" ? zsh(verbs) : fish(verbs));
  });
}

}  // namespace meniscus::cli
