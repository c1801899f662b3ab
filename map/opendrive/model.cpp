#include "pictura/map/opendrive/model.h"

#include <algorithm>

#include "pictura/common/error.h"

namespace pictura::opendrive {

const FileLane* FileSection::lane(int id) const {
  const std::vector<FileLane>& side = id > 0 ? left : right;
  const std::size_t index = static_cast<std::size_t>(std::abs(id)) - 1;
  return id != 0 && index < side.size() ? &side[index] : nullptr;
}

Source::Source(std::string name, std::string_view text) : name_(std::move(name)) {
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n', end + 1)) {
    line_ends_.push_back(static_cast<std::ptrdiff_t>(end));
  }
}

int32_t Source::line_at(std::ptrdiff_t offset) const {
  return 1 + static_cast<int32_t>(std::lower_bound(line_ends_.begin(), line_ends_.end(), offset) - line_ends_.begin());
}

void SourceLocation::fail_with(const std::string& message) const {
  pictura::fail("{}:{}: {}: <{}>: {}", source ? source->name() : "network", line(), owner, element, message);
}

void SourceLocation::record_repair_with(Faults* faults, RepairKind kind, const std::string& message) const {
  faults->record_repair({kind, line(), fmt::format("{}: <{}>: {}", owner, element, message)}, source->name());
}

}  // namespace pictura::opendrive
