// Folders that a command fills with files whose names the command chooses.
#pragma once

#include <set>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

/// A folder that a command refills. Files that an earlier call of the same kind wrote are removed, unless this call
/// writes them again. The hidden file .pictura-KIND in the folder lists the written files; files that it does not list
/// stay.
class FilledFolder {
 public:
  /// Creates the folder. Throws Error as make_output_folder() does, or if the list is a symbolic link.
  FilledFolder(std::string folder, const std::string& kind);

  const std::string& path() const { return folder_; }
  /// Returns "FOLDER/NAME" for the next file to write. Throws Error if that name is a symbolic link, because the link
  /// may lead out of the folder.
  std::string file(const std::string& name);
  /// Removes files of earlier calls whose names were not passed to file().
  void remove_others();

 private:
  const std::string folder_, list_;
  Descriptor list_file_;  // names are appended to it
  std::set<std::string> written_, listed_;
};

}  // namespace pictura
