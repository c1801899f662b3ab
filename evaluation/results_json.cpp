#include "pictura/evaluation/results_json.h"

#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

namespace {

constexpr const char* kExpected = "expected results written by pictura evaluate --out";

}  // namespace

Json to_json(const EvaluationSetting& s) {
  Json conditioning;
  for (size_t i = 0; i < kNumConditioning; ++i) conditioning[kConditioningNames[i]] = s.conditioning[i];
  return {{"policy_hash", s.policy_hash},
          {"maps", s.maps},
          {"maps_hash", s.maps_hash},
          {"cameras_hash", s.cameras_hash},
          {"config", s.config},
          {"steps", s.steps},
          {"argmax", s.argmax},
          {"seed", s.seed},
          {"precision", s.precision},
          {"device", s.device},
          {"renderer", s.renderer},
          {"samples", s.samples},
          {"image_sizes", s.image_sizes},
          {"conditioning", conditioning},
          {"light_cycles", name_of(s.light_cycles)},
          {"light_heads", s.light_heads},
          {"others", s.others},
          {"camera_severity", s.camera_severity}};
}

EvaluationSetting setting_from(const Json& json) {
  EvaluationSetting s;
  json.at("policy_hash").get_to(s.policy_hash);
  json.at("maps").get_to(s.maps);
  s.maps_hash = json.value("maps_hash", "");
  s.cameras_hash = json.value("cameras_hash", "");
  s.config = json.value("config", s.config);
  json.at("steps").get_to(s.steps);
  json.at("argmax").get_to(s.argmax);
  json.at("seed").get_to(s.seed);
  json.at("precision").get_to(s.precision);
  json.at("device").get_to(s.device);
  json.at("renderer").get_to(s.renderer);
  json.at("samples").get_to(s.samples);
  json.at("image_sizes").get_to(s.image_sizes);
  s.light_heads = json.value("light_heads", s.light_heads);
  s.others = json.value("others", s.others);
  s.camera_severity = json.value("camera_severity", s.camera_severity);
  for (size_t i = 0; i < kNumConditioning; ++i) {
    json.at("conditioning").at(kConditioningNames[i]).get_to(s.conditioning[i]);
  }
  // Files of versions with only one kind of light cycles lack this key.
  s.light_cycles = light_cycles_named(json.value("light_cycles", name_of(LightCycles::phases)));
  return s;
}

void check_same(const Json& first, const std::string& first_name, const Json& other, const std::string& other_name,
                const std::string& within) {
  Json of_both = first;
  of_both.update(other);
  for (const auto& [key, either] : of_both.items()) {
    const Json value = first.value(key, Json()), other_value = other.value(key, Json());
    if (value.is_object() && other_value.is_object()) {
      check_same(value, first_name, other_value, other_name, within + key + ".");
    } else {
      PICTURA_CHECK(value == other_value, "{}: {}{} is {}, in {} {}", other_name, within, key, other_value.dump(),
                    first_name, value.dump());
    }
  }
}

Json read_results_json(const std::string& path, const std::vector<std::string>& formats) {
  const std::string text = read_file(path);
  Json json;
  try {
    json = parse_json(text);
  } catch (const Json::parse_error& error) {
    fail("{}: {}, got invalid JSON from byte {}", path, kExpected, error.byte);
  } catch (const Json::out_of_range&) {
    fail("{}: {}, got a number outside the range of a double", path, kExpected);
  }
  parse_results(path, [&] {
    PICTURA_CHECK(std::find(formats.begin(), formats.end(), json.value("format", "")) != formats.end(),
                  "expected \"format\": \"{}\"", fmt::join(formats, "\" or \""));
  });
  return json;
}

void parse_results(const std::string& path, const std::function<void()>& parse) {
  try {
    parse();
  } catch (const Json::exception&) {
    fail("{}: {}, got JSON with a missing value or a value of a wrong type", path, kExpected);
  } catch (const Error& error) {
    fail("{}: {}: {}", path, kExpected, error.what());
  }
}

}  // namespace pictura
