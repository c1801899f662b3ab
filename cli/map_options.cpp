#include "pictura/cli/map_options.h"

#include <algorithm>

#include "pictura/cli/file_options.h"
#include "pictura/map/map_copy.h"

namespace pictura {

namespace {

// Whether a piece has the form NAME=VALUE, so that it cannot be the name of a map.
bool is_option_of_town(const std::string& piece) {
  const std::size_t equals = piece.find('=');
  return equals != std::string::npos && piece.find_first_of(":/") > equals;
}

// Whether the piece after `before` is a longitude: `before` ends with FILE.osm@LATITUDE.
bool is_longitude_after(const std::string& before) {
  const std::size_t place = before.rfind(".osm@");
  return place != std::string::npos && before.find(',', place) == std::string::npos;
}

}  // namespace

CLI::Option* add_map_list_option(CLI::App* command, std::vector<std::string>* maps, const std::string& help) {
  constexpr char kComma = ',';
  const auto split = [maps](const std::vector<std::string>& words) {
    maps->clear();
    for (const std::string& word : words) {
      for (std::size_t begin = 0; begin <= word.size();) {
        const std::size_t end = std::min(word.find(kComma, begin), word.size());
        const std::string piece = word.substr(begin, end - begin);
        if (begin > 0 && (is_option_of_town(piece) || is_longitude_after(maps->back())))
          maps->back() += kComma + piece;
        else
          maps->push_back(piece);
        begin = end + 1;
      }
    }
    *maps = expand_map_names(*maps);
  };
  std::string otherwise;
  for (const std::string& map : *maps) otherwise += (otherwise.empty() ? "" : ",") + map;
  return command->add_option_function<std::vector<std::string>>("--map", split, help)
      ->check(input_file())
      ->allow_extra_args(false)
      ->type_name("MAP")
      ->default_str(otherwise);
}

}  // namespace pictura
