#include "pictura/map/opendrive/document.h"

#include <cstring>

#include "pictura/common/error.h"

namespace pictura::opendrive {

namespace {

constexpr int kMaxDepth = 64;
constexpr std::size_t kMaxAttribute_bytes = std::size_t{1} << 12;  // attributes are copied with each object and mark

/// Returns the length of the UTF-8 sequence at the beginning of `text`, or 0 if it is invalid.
std::size_t sequence_length(std::string_view text) {
  const unsigned char lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xf5 ? 0 : lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : lead >= 0xc2 ? 2 : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) return 0;
  }
  return length;
}

void check_characters(std::string_view text, const Source& source) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = text[i] == '\0' ? 0 : sequence_length(text.substr(i));
    if (length == 0) {
      fail("{}:{}: expected UTF-8 text, got the byte {:#04x}", source.name(),
           source.line_at(static_cast<std::ptrdiff_t>(i)), static_cast<unsigned char>(text[i]));
    }
    i += length;
  }
}

/// Checks every node. Neither this class nor the parser recurses, so deep nesting cannot overflow the call stack.
class ShapeCheck : public pugi::xml_tree_walker {
 public:
  explicit ShapeCheck(const Source& source) : source_(source) {}

  bool for_each(pugi::xml_node& node) override {
    if (node.type() == pugi::node_doctype) fail_at(node, "a document type (<!DOCTYPE>) is not supported");
    if (std::strcmp(node.name(), "include") == 0) fail_at(node, "<include>: files of several parts are not supported");
    if (depth() > kMaxDepth) fail_at(node, fmt::format("elements are nested more than {} deep", kMaxDepth));
    for (const pugi::xml_attribute attribute : node.attributes()) {
      const std::size_t bytes = std::strlen(attribute.value());
      if (bytes > kMaxAttribute_bytes) {
        fail_at(node, fmt::format("<{}> attribute {}: expected at most {} bytes, got {}", node.name(), attribute.name(),
                                  kMaxAttribute_bytes, bytes));
      }
    }
    return true;
  }

 private:
  [[noreturn]] void fail_at(const pugi::xml_node& node, const std::string& message) const {
    fail("{}:{}: {}", source_.name(), source_.line_at(node.offset_debug()), message);
  }

  const Source& source_;
};

}  // namespace

void read_document(std::string_view text, const Source& source, pugi::xml_document* document_out) {
  check_characters(text, source);
  const pugi::xml_parse_result parsed = document_out->load_buffer(
      text.data(), text.size(), pugi::parse_default | pugi::parse_doctype, pugi::encoding_utf8);
  if (!parsed) {
    fail("{}:{}: expected well-formed XML: {}", source.name(), source.line_at(parsed.offset), parsed.description());
  }
  ShapeCheck check(source);
  document_out->traverse(check);
}

}  // namespace pictura::opendrive
