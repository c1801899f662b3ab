// Folders that a command fills with files of its own naming.
#pragma once

#include <set>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

/// A folder that a command refills: files that earlier calls of the same kind wrote, and this call does not, are
/// removed. A hidden list in the folder, .pictura-KIND, holds the names of written files; all other files stay.
class FilledFolder {
 public:
  /// Creates the folder. Throws Error as make_output_folder() does, and for a list that is a link.
  FilledFolder(std::string folder, const std::string& kind);

  const std::string& path() const { return folder_; }
  /// Returns "FOLDER/NAME" for the next file to write. Throws Error for a link of that name, which would lead out of
  /// the folder.
  std::string file(const std::string& name);
  /// Removes files of earlier calls whose names were not passed to file().
  void remove_others();

 private:
  const std::string folder_, list_;
  Descriptor list_file_;  // names are appended to it
  std::set<std::string> written_, listed_;
};

}  // namespace pictura
