#include "pictura/driving/reported_map.h"

#include "pictura/common/support/messages.h"

namespace pictura {

std::shared_ptr<const RoadMap> load_reported_map(const std::string& name) {
  LoadReport report;
  std::shared_ptr<const RoadMap> map = load_map(name, {}, &report);
  if (const std::size_t count = map->mends.size()) {
    print_message("{}: {} fault{} repaired; `pictura map` lists them\n", printable(report.source), count,
                  count == 1 ? "" : "s");
  }
  return map;
}

void print_repairs(const RoadMap& map, const std::string& source) {
  if (map.mends.empty()) return;
  for (const std::string& line : describe_repairs(map.mends, source)) {
    print_message("repaired: {}\n", printable(line));
  }
  print_message("{} fault{} repaired; --json lists all, --strict rejects them\n", map.mends.size(),
                map.mends.size() == 1 ? "" : "s");
}

}  // namespace pictura
