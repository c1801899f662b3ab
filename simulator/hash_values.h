// Hashing of values and names.
#pragma once

#include <string>

#include "pictura/common/support/hash.h"

namespace pictura {

/// Adds the bytes of values. Their types must have no padding.
template <typename... Values>
void add_values(Hash64* hash_inout, const Values&... values) {
  (hash_inout->add_bytes(&values, sizeof(values)), ...);
}

inline void add_name(Hash64* hash_inout, const std::string& name) {
  add_values(hash_inout, name.size());
  hash_inout->add_bytes(name.data(), name.size());
}

}  // namespace pictura
