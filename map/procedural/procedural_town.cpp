#include "pictura/map/procedural/procedural_town.h"

#include "pictura/map/opendrive/writer.h"
#include "pictura/map/procedural/town_builder.h"

namespace pictura {

std::string procedural_town(const TownOptions& options) {
  check_town_options(options);
  const town::Layout layout(options);
  return opendrive::write_opendrive(town::TownBuilder(layout).take());
}

}  // namespace pictura
