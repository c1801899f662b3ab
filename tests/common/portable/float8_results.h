// Results of the operations on Float8, in a register or in memory, as the including file's compiler options select.
#pragma once

#include <cstring>
#include <vector>

#include "pictura/common/portable/float8.h"

namespace pictura {

struct Float8Inputs {
  float a[16], b[8];  // finite and not 0; `a` in the range of int32_t
  int32_t integers[8], indices[8];
  uint32_t mask;
};

/// results_of(), compiled for the form in memory.
std::vector<uint32_t> results_in_memory(const Float8Inputs& in);

namespace {

std::vector<uint32_t> results_of(const Float8Inputs& in) {
  std::vector<uint32_t> results;
  auto add_words = [&](const auto* words, int count) {
    for (int k = 0; k < count; ++k) {
      uint32_t word;
      std::memcpy(&word, &words[k], sizeof(word));
      results.push_back(word);
    }
  };
  auto add = [&](const Float8& of) {
    float elements[8];
    store8(of, elements);
    add_words(elements, 8);
  };
  auto add_mask = [&](const Mask8& mask) { results.push_back(bits_of(mask)); };

  const Float8 a = load8(in.a), b = load8(in.b), integers = load8_integers(in.integers);
  for (const Float8& of : {a, b, integers, Float8(in.a[1]), set8(1, 2, 3, 4, 5, 6, 7, 8)}) add(of);
  for (const Float8& of : {a + b, a - b, a * b, a / b, -a, magnitude(a), round_down(a), round_up(a)}) add(of);
  for (const Float8& of : {min_no_nan(a, b), max_no_nan(a, b), saturate(a), sqrt_in_range(magnitude(a))}) add(of);
  for (const Float8& of : {reciprocal_in_range(a), keep_bits(a, 0xFFFF0000u), swap_pairs(a)}) add(of);
  for (const Float8& of : {blend<0b01100101>(a, b), permute<7, 1, 0, 3, 3, 2, 6, 5>(a)}) add(of);

  const Mask8 less = a < b, near = magnitude(a - b) <= 1.0f;
  for (const Mask8& mask : {less, near, a > b, a >= b, a <= b, less & near, less | near, less ^ near, ~less}) {
    add_mask(mask);
    add(select(mask, a, b));
  }
  for (const Mask8& mask : {less_bits(a, b), equal_bits(a, b), less_bits(b, a)}) add_mask(mask);
  for (int k = 0; k < 8; ++k) {
    const float element = a[k];
    add_words(&element, 1);
  }

  Float8 of_pairs[2], of_indices[2], of_fours[4];
  load_pairs(in.a, &of_pairs[0], &of_pairs[1]);
  gather_pairs(in.a, in.indices, &of_indices[0], &of_indices[1]);
  gather_fours([&](int k) -> const void* { return in.a + in.indices[k]; }, of_fours);
  for (const Float8& of : of_pairs) add(of);
  for (const Float8& of : of_indices) add(of);
  for (const Float8& of : of_fours) add(of);

  // Elements after the chosen are unspecified.
  int32_t stored[8], chosen[8], numbers[8];
  const int num_chosen = __builtin_popcount(in.mask);
  store8_integers(a, stored);
  copy_chosen(in.integers, in.mask, chosen);
  store_chosen(-3, in.mask, numbers);
  add_words(stored, 8);
  add_words(chosen, num_chosen);
  add_words(numbers, num_chosen);
  results.push_back(equal8(in.integers, in.integers[3]));

  SmallestKeys<2> least;
  for (int k = 0; k < 16; ++k) least.insert(int64_t{in.integers[k % 8]} * in.indices[(k + k / 8) % 8] + k);
  int64_t keys[SmallestKeys<2>::kCount];
  least.store(keys);
  for (const int64_t key : keys) {
    results.push_back(static_cast<uint32_t>(key));
    results.push_back(static_cast<uint32_t>(key >> 32));
  }
  return results;
}

}  // namespace
}  // namespace pictura
