// TOML read strictly: every key is asked for by name, type and range, and what nobody asked for is refused. Messages
// name the file, the line, the table and the key. Not installed: toml++ is no part of what the headers ask of their
// users.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "pictura/common/camera.h"
#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Parses a TOML text. Throws Error naming source and line.
toml::table parse_toml(const std::string& text, const std::string& source);

/// The whole number that a value is, in any notation: 1e3 and 1000.0 are what 1000 is. Nothing for other values.
std::optional<int64_t> whole_number(const toml::node& node);

/// A value as messages show it, in one short line.
std::string shown(const toml::node& node);

/// One table. Readers with a fallback return it where the key is missing; the others throw. All throw Error when the
/// type or the range is wrong. The table must outlive the object.
class TomlFields {
 public:
  struct Range {
    double low, high;  // both included
  };

  /// `name` is what messages call the table, such as "camera 2"; empty for the whole file.
  TomlFields(const toml::table& table, std::string source, std::string name = "");

  /// What messages call the table from now on.
  void rename(std::string name) { name_ = std::move(name); }
  bool has(std::string_view key) { return find(key) != nullptr; }
  float number(std::string_view key, Range range);
  float number(std::string_view key, Range range, float fallback);
  int integer(std::string_view key, Range range);
  int integer(std::string_view key, Range range, int fallback);
  bool flag(std::string_view key, bool fallback);
  std::string text(std::string_view key, const std::string& fallback);
  /// A text that may be part of a file's name: letters, digits, '-' and '_', 64 at most.
  std::string file_name(std::string_view key, const std::string& fallback);
  /// Index of the text among `names`. A fallback of -1 makes the key a must.
  int choice(std::string_view key, Span<const std::string_view> names, int fallback = -1);
  /// A list of `size` numbers.
  std::vector<float> numbers(std::string_view key, Range range, std::size_t size);
  std::vector<int> integers(std::string_view key, Range range, std::vector<int> fallback);
  /// A list of [x, y] (z is 0 then) or [x, y, z], at least `least` of them.
  std::vector<Vec3> points(std::string_view key, Range range, std::size_t least);
  /// The [[key]] tables, none where there are none.
  std::vector<TomlFields> tables(std::string_view key);

  /// Throws for the first key that was not asked for; call when all were.
  void refuse_unknown() const;
  /// "file:line: table: key: message".
  [[noreturn]] void refuse(std::string_view key, std::string_view message) const;

 private:
  const toml::node* find(std::string_view key);  // and remembers that the key is known
  const toml::node& need(std::string_view key);
  int integer_of(std::string_view key, const toml::node& node, Range range) const;
  float number_of(std::string_view key, const toml::node& node, Range range) const;
  const toml::array& list_of(std::string_view key, const toml::node& node) const;
  [[noreturn]] void refuse(std::string_view key, const toml::node& node, std::string_view expected) const;

  const toml::table* table_;
  std::string source_, name_;
  std::vector<std::string> known_;
};

/// The rig of the [[camera]] tables (docs/explanation/image.md); it has no cameras where there are none.
Rig read_cameras(TomlFields* fields_inout);

}  // namespace pictura
