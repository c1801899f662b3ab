// Folders that a command fills with files.
#pragma once

#include <set>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

/// Returns the names of the files with which a FilledFolder of this kind has filled the folder.
std::set<std::string> filled_files(const std::string& folder, const std::string& kind);

/// A folder that a command fills. Files of earlier calls are removed unless they are written again. The hidden file
/// .pictura-KIND lists the written files. Other files stay.
class FilledFolder {
 public:
  /// Throws Error as make_output_folder() does, or if the list is a symbolic link.
  FilledFolder(std::string folder, const std::string& kind);

  const std::string& path() const { return folder_; }
  /// Returns "FOLDER/NAME" for a file to write. Throws Error if it is a symbolic link, which may lead out of the
  /// folder.
  std::string file(const std::string& name);
  /// Removes files of earlier calls that were not written again.
  void remove_others();

 private:
  const std::string folder_, list_;
  Descriptor list_file_;
  std::set<std::string> written_, listed_;
};

}  // namespace pictura
