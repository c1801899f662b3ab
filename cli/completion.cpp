#include "pictura/cli/completion.h"

#include <map>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/configuration/config_keys.h"
#include "pictura/simulator/controllers/host_controllers.h"

namespace pictura {

namespace {

struct Word {
  std::string text, help;
  bool takes_value = false;
  std::vector<std::string> values;  // possible values, which are offered in addition to files
};

/// A command of the tree, with the words that may follow it.
struct Place {
  std::string path;  // for instance "pictura bench render"
  std::vector<Word> commands, options;
  std::vector<std::string> arguments;  // possible words of a positional argument
};

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// Returns the choices in a type's name. CLI11 writes them in braces, such as "TEXT:{u8,f16}".
std::vector<std::string> choices_of(const std::string& type_name) {
  const size_t begin = type_name.find('{'), end = type_name.find('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type_name.substr(begin + 1, end - begin - 1), ',');
}

std::vector<std::string> map_names() {
  std::vector<std::string> names = Config{}.simulator.maps;
  names.insert(names.end(), {"procedural:1", "city:1"});
  return names;
}

std::vector<std::string> keys_with_sign() {
  std::vector<std::string> words;
  for (const ConfigKey& key : config_keys()) words.push_back(key.key + "=");
  return words;
}

/// Returns the possible values of an option, from its type or its name.
std::vector<std::string> values_of(const CLI::Option& option) {
  if (const std::vector<std::string> choices = choices_of(option.get_type_name()); !choices.empty()) return choices;
  const std::string name = option.get_single_name();
  if (name == "map" || name == "MAP") return map_names();
  if (name == "policy" || name == "controller") return host_controller_names();
  if (name == "set") return keys_with_sign();
  return {};
}

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

void add_places(const CLI::App& command, const std::string& path, std::vector<Place>* places_out) {
  const std::vector<const CLI::App*> children = command.get_subcommands([](const CLI::App*) { return true; });
  Place place{path, {}, {}};
  for (const CLI::App* child : children) {
    place.commands.push_back({child->get_name(), first_line(child->get_description()), false});
  }
  for (const CLI::Option* option : command.get_options()) {
    const std::vector<std::string> values = values_of(*option);
    if (option->get_positional()) place.arguments.insert(place.arguments.end(), values.begin(), values.end());
    for (const std::string& name : option->get_lnames()) {
      place.options.push_back(
          {"--" + name, first_line(option->get_description()), option->get_items_expected_max() > 0, values});
    }
  }
  places_out->push_back(std::move(place));
  for (const CLI::App* child : children) add_places(*child, path + " " + child->get_name(), places_out);
}

/// Quotes a text for shells.
std::string in_quotes(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}
/// Quotes a text for fish, which interprets \' between quotes.
std::string in_fish_quotes(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return result + "'";
}

/// Returns the `case` patterns of all subcommands.
std::string known_paths(const std::vector<Place>& places) {
  std::string paths;
  for (size_t i = 1; i < places.size(); ++i) paths += (i > 1 ? " | " : "") + in_quotes(places[i].path);
  return paths;
}

/// Returns the `case` items that set `values` to the possible values of the current command and option.
std::string value_cases(const std::vector<Place>& places) {
  std::map<std::string, std::string> patterns_of_values;
  for (const Place& place : places) {
    for (const Word& word : place.options) {
      if (word.values.empty()) continue;
      std::string& patterns = patterns_of_values[joined(word.values)];
      patterns += (patterns.empty() ? "" : " | ") + in_quotes(place.path + " " + word.text);
    }
  }
  std::string cases;
  for (const auto& [values, patterns] : patterns_of_values) {
    cases += fmt::format("    {}) values={} ;;\n", patterns, in_quotes(values));
  }
  return cases;
}

std::string bash_script(const std::string& name, const std::vector<Place>& places) {
  std::string cases;
  for (const Place& place : places) {
    std::string commands, options;
    for (const Word& word : place.commands) commands += (commands.empty() ? "" : " ") + word.text;
    for (const Word& word : place.options) options += (options.empty() ? "" : " ") + word.text;
    cases += fmt::format("    {}) commands={} options={} values={} ;;\n", in_quotes(place.path), in_quotes(commands),
                         in_quotes(options), in_quotes(joined(place.arguments)));
  }
  return fmt::format(
      R"(# Completion of {0} for bash: source it, or put it into ~/.local/share/bash-completion/completions/{0}.
_{0}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} place={0} commands='' options='' values='' i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "$place ${{COMP_WORDS[i]}}" in
      {1}) place="$place ${{COMP_WORDS[i]}}" ;;
    esac
  done
  case $place in
{2}  esac
  case "$place ${{COMP_WORDS[COMP_CWORD - 1]}}" in
{3}  esac
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")
  elif [[ -n $commands ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$commands" -- "$word")
  elif [[ -n $values ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$word"; compgen -f -- "$word")
    if [[ ${{COMPREPLY[0]}} == *= ]]; then compopt -o nospace 2>/dev/null; fi
  fi
}}
complete -o default -F _{0} {0}
)",
      name, known_paths(places), cases, value_cases(places));
}

std::string zsh_script(const std::string& name, const std::vector<Place>& places) {
  // A colon separates a word from its help.
  const auto entries = [](const std::vector<Word>& words) {
    std::string list;
    for (const Word& word : words) list += " " + in_quotes(word.text + ":" + word.help);
    return list;
  };
  std::string cases;
  for (const Place& place : places) {
    cases += fmt::format("    {}) commands=({} ) options=({} ) values={} ;;\n", in_quotes(place.path),
                         entries(place.commands), entries(place.options), in_quotes(joined(place.arguments)));
  }
  return fmt::format(R"(#compdef {0}
# Completion of {0} for zsh: put it as _{0} into a folder of $fpath.
_{0}() {{
  local place={0} values='' word
  local -a commands options
  for word in "${{(@)words[2,CURRENT-1]}}"; do
    case "$place $word" in
      {1}) place="$place $word" ;;
    esac
  done
  case $place in
{2}  esac
  case "$place $words[CURRENT-1]" in
{3}  esac
  if [[ $words[CURRENT] == -* ]]; then
    _describe option options
  elif (( $#commands )); then
    _describe command commands
  elif [[ $values == *= ]]; then
    compadd -S '' -- ${{=values}}
  else
    compadd -- ${{=values}}
    _files
  fi
}}
compdef _{0} {0}
)",
                     name, known_paths(places), cases, value_cases(places));
}

std::string fish_script(const std::string& name, const std::vector<Place>& places) {
  std::string script = fmt::format(R"(# Completion of {0} for fish: put it into ~/.config/fish/completions/{0}.fish.
function __{0}_is_at
  set -l place {0}
  for word in (commandline -opc)[2..-1]
    switch "$place $word"
      case {1}
        set place "$place $word"
    end
  end
  test "$place" = "$argv"
end
)",
                                   name, [&places] {
                                     std::string paths;
                                     for (size_t i = 1; i < places.size(); ++i) {
                                       paths += (i > 1 ? " " : "") + in_fish_quotes(places[i].path);
                                     }
                                     return paths;
                                   }());
  for (const Place& place : places) {
    const std::string here =
        fmt::format("complete -c {} -n {}", name, in_fish_quotes(fmt::format("__{}_is_at {}", name, place.path)));
    for (const Word& word : place.commands) {
      script += fmt::format("{} -f -a {} -d {}\n", here, word.text, in_fish_quotes(word.help));
    }
    for (const Word& word : place.options) {
      script += fmt::format("{} -l {}{}{} -d {}\n", here, word.text.substr(2), word.takes_value ? " -r" : "",
                            word.values.empty() ? "" : " -a " + in_fish_quotes(joined(word.values)),
                            in_fish_quotes(word.help));
    }
    if (!place.arguments.empty()) script += fmt::format("{} -a {}\n", here, in_fish_quotes(joined(place.arguments)));
  }
  return script;
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  std::vector<Place> places;
  add_places(app, app.get_name(), &places);
  if (shell == "bash") return bash_script(app.get_name(), places);
  if (shell == "zsh") return zsh_script(app.get_name(), places);
  if (shell == "fish") return fish_script(app.get_name(), places);
  const std::vector<std::string> known{"bash", "zsh", "fish"};
  fail_usage("completion: expected bash, zsh or fish, got '{}'{}", shell, suggestion(shell, known));
}

}  // namespace pictura
