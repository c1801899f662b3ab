// Arrays at public interfaces: their descriptions as text, and errors that contain these descriptions.
#include "pictura/common/array.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::HasSubstr;

constexpr Device kGpu{MemorySpace::cuda, 1};

TEST(Array, AContainerIsOneDimensionOnTheHost) {
  std::vector<int32_t> actions{1, 2, 3};
  const Array array = actions;
  EXPECT_EQ(array.text(), "i32 [3] on cpu");
  const Span<const int32_t> span = array.checked<const int32_t>("step: actions", {3}, {});
  EXPECT_EQ(span.data(), actions.data());
  EXPECT_EQ(span.size(), 3u);
}

TEST(Array, StoresEnumerationsAsTheirIntegers) {
  enum class Light : uint8_t { red, green };
  std::vector<Light> lights{Light::green, Light::red};
  const Array array = lights;
  EXPECT_EQ(array.text(), "u8 [2] on cpu");
  EXPECT_EQ(array.checked<const Light>("lights", {2}, {})[0], Light::green);
  EXPECT_EQ(array.checked<const uint8_t>("lights", {2}, {})[0], 1);
}

TEST(Span, IsIndexedByAnyInteger) {
  const std::vector<float> values{1, 2, 3};
  const int count = 2;
  const Span<const float> span{values.data(), count};
  EXPECT_EQ(span.size(), 2u);
  EXPECT_EQ(span[int64_t{1}], 2);
  EXPECT_EQ(span[uint8_t{1}], 2);
  EXPECT_EQ(span.subspan(count - 1, 1)[0], 2);
}

TEST(Array, StridesFollowTheShape) {
  float data[24] = {};
  const Array array(data, {2, 3, 4}, Device{});
  EXPECT_EQ(array.strides, (Dims{12, 4, 1}));
  EXPECT_TRUE(array.is_contiguous());
  EXPECT_EQ(array.shape.count(), 24);
}

TEST(Array, ErrorsNameTheArray) {
  std::vector<float> values(8);
  const Array array = values;
  auto refused = [&](auto element, Dims shape, Device device) {
    return message_of([&] { array.checked<const decltype(element)>("step: actions", shape, device); });
  };
  EXPECT_THAT(refused(int32_t{}, {8}, Device{}),
              HasSubstr("step: actions: expected i32 [8] on cpu, got f32 [8] on cpu"));
  EXPECT_THAT(refused(float{}, {4, 2}, Device{}), HasSubstr("expected f32 [4, 2] on cpu, got f32 [8] on cpu"));
  EXPECT_THAT(refused(float{}, {8}, kGpu), HasSubstr("expected f32 [8] on cuda:1, got f32 [8] on cpu"));
  const std::vector<float> constant(8);
  EXPECT_THAT(message_of([&] { Array(constant).checked<float>("images", {8}, {}); }),
              HasSubstr("images: expected f32 [8] on cpu, writable, got f32 [8] on cpu, read-only"));
  Array gaps = array;
  gaps.strides = {2};
  EXPECT_THAT(message_of([&] { gaps.checked<float>("images", {8}, {}); }), HasSubstr("with strides [2]"));
  EXPECT_THAT(message_of([&] { Array(static_cast<float*>(nullptr), {8}, {}).checked<float>("images", {8}, {}); }),
              HasSubstr("at a null address"));
  EXPECT_THROW((Dims{1, 2, 3, 4, 5, 6}), Error);
}

}  // namespace
}  // namespace pictura
