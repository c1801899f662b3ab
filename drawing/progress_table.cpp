#include "pictura/drawing/progress_table.h"

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/numbers.h"

namespace pictura {

ProgressTable::ProgressTable(const std::string& run_folder) : path_(run_folder + "/progress.csv") {
  PICTURA_CHECK(std::filesystem::is_directory(run_folder), "{}: expected the folder of a training run", run_folder);
  PICTURA_CHECK(std::filesystem::exists(path_), "{}: expected the folder of a training run: it has no progress.csv",
                run_folder);
  std::istringstream lines(read_file(path_));
  std::string line, cell;
  std::getline(lines, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) {
    PICTURA_CHECK(columns_.try_emplace(cell).second, "{}:1: column '{}' stands twice", path_, cell);
    names_.push_back(cell);
  }
  for (int number = 2; std::getline(lines, line); ++number) {
    size_t column = 0;
    for (std::istringstream cells(line); std::getline(cells, cell, ','); ++column) {
      const std::optional<double> value = parse_written_number(cell);
      PICTURA_CHECK(column < names_.size() && value, "{}:{}: expected {} numbers, got '{}' as number {}", path_, number,
                    names_.size(), cell, column + 1);
      columns_[names_[column]].push_back(*value);
    }
    PICTURA_CHECK(column == names_.size(), "{}:{}: expected {} numbers, got {}", path_, number, names_.size(), column);
    ++num_rows_;
  }
}

const std::vector<double>& ProgressTable::column(const std::string& name) const {
  const auto found = columns_.find(name);
  PICTURA_CHECK(found != columns_.end(), "{}: expected a column '{}'; it has {}", path_, name, fmt::join(names_, ", "));
  return found->second;
}

}  // namespace pictura
