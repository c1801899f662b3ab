#include "pictura/map/scenario/scene_file.h"

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/map/scenario/scenario_fields.h"

namespace pictura {

FieldFileKind scene_file_kind() {
  std::string layout;
  append_layout<Scenario>(&layout);
  return {.magic = {'P', 'I', 'C', 'T', 'S', 'C', 'E', 'N'},
          .layout = hash_of(layout),
          .other = "expected the fields of this version's scenes: it was written by another version of pictura"};
}

void write_scene_file(const std::string& path, const Scenario& scenario) {
  if (!path.ends_with(kSceneFileEnding)) fail_usage("expected a file *{}, got '{}'", kSceneFileEnding, path);
  write_file(path, encode_fields(scene_file_kind(), {}, [&](FieldWriter* writer) { writer->put(scenario); }));
}

Scenario parse_scene_file(std::string_view bytes, const std::string& name) {
  Scenario scenario;
  decode_fields(bytes, scene_file_kind(), {}, name, [&](FieldReader* reader) {
    reader->get(&scenario);
    validate(scenario);
  });
  return scenario;
}

}  // namespace pictura
