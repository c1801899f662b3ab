// progress.csv of a training run, by columns.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace pictura {

class ProgressTable {
 public:
  /// Reads progress.csv of a run's folder. Throws Error naming the folder where there is none, or the file and line
  /// that are something else.
  explicit ProgressTable(const std::string& run_folder);

  const std::string& path() const { return path_; }
  /// In the order of the file; the first is "update".
  const std::vector<std::string>& names() const { return names_; }
  size_t num_rows() const { return num_rows_; }
  /// Throws Error naming the file, the column and those that there are.
  const std::vector<double>& column(const std::string& name) const;

 private:
  std::string path_;
  std::vector<std::string> names_;
  std::map<std::string, std::vector<double>> columns_;
  size_t num_rows_ = 0;
};

}  // namespace pictura
