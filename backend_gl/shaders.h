// The pipeline's two programs: drawing and averaging of samples.
#pragma once

namespace pictura::gl {

/// Vertex shader of faces. Hardware rounds the positions of corners (GL_SUBPIXEL_BITS) but does not adapt their depths,
/// which tilts faces. Near the horizon, this error exceeds the depth difference between strips of one level. So this
/// shader rounds the positions itself, and computes depths there.
constexpr const char* kFaceVertexShader = R"(#version 450 core
#extension GL_ARB_shader_viewport_layer_array : require
layout(location = 0) in vec3 corner0;  // camera coordinates
layout(location = 1) in vec3 corner1;
layout(location = 2) in vec3 corner2;
layout(location = 3) in vec3 corner3;
layout(location = 4) in vec3 compared_plane;
layout(location = 5) in vec3 color;
layout(location = 6) in int layer;
uniform vec4 projection;  // scale of x and y, offset of x and y
uniform vec2 positions;   // corner positions that the driver distinguishes along half an image's width and height
uniform vec2 inverse_depth;    // bounds on the ratio of a corner's depth to that of compared_plane (see FaceInstance)
uniform float near_m;
flat out vec3 face_color;
void main() {
  // A strip of two triangles covers the quadrilateral.
  vec3 p = gl_VertexID == 0 ? corner0 : gl_VertexID == 1 ? corner1 : gl_VertexID == 2 ? corner3 : corner2;
  vec2 at = projection.xy * p.xy + projection.zw * p.z;  // on screen, times depth
  // Points behind the near plane have no position on screen. Clipping replaces them by corners so far below the horizon
  // that their rounding hardly tilts the plane.
  if (p.z >= near_m) {
    at = round(at / p.z * positions) / positions * p.z;
    p.xy = (at - projection.zw * p.z) / projection.xy;
  }
  // The ratio of the corner's depth to that of the compared plane.
  float nearer = compared_plane == vec3(0.0) ? 1.0 : clamp(dot(compared_plane, p), inverse_depth.x, inverse_depth.y);
  // Inverse depth: 1 at the near plane, 0 infinitely far.
  gl_Position = vec4(at, near_m * nearer, p.z);
  gl_Layer = layer;
  face_color = color;
}
)";

constexpr const char* kFaceFragmentShader = R"(#version 450 core
flat in vec3 face_color;
out vec4 color;
void main() { color = vec4(face_color, 1.0); }
)";

/// Compute shader that averages samples. Definitions of MULTISAMPLE and PACKED as 0 or 1 must precede it. An invocation
/// writes one word of each colour plane: four bytes (PACKED) or one float.
constexpr const char* kResolveShader = R"(
#if MULTISAMPLE
uniform sampler2DMSArray drawn;
#else
uniform sampler2DArray drawn;
#endif
uniform ivec2 size;      // width and height of an image, pixels
uniform int grid;        // texels of a pixel along each axis
uniform int samples;     // samples of a texel
uniform int plane_words;
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Images {
#if PACKED
  uint words[];
#else
  float words[];
#endif
};

vec3 mean_of(ivec2 pixel, int layer) {
  vec3 sum = vec3(0.0);
  for (int y = 0; y < grid; ++y) {
    for (int x = 0; x < grid; ++x) {
      ivec3 texel = ivec3(grid * pixel + ivec2(x, y), layer);
#if MULTISAMPLE
      for (int i = 0; i < samples; ++i) sum += texelFetch(drawn, texel, i).rgb;
#else
      sum += texelFetch(drawn, texel, 0).rgb;
#endif
    }
  }
  return clamp(sum / float(grid * grid * samples), 0.0, 1.0);
}

void resolve(int word, int layer) {
#if PACKED
  uvec3 value = uvec3(0);
  for (int i = 0; i < 4; ++i) {
    int pixel = 4 * word + i;
    if (pixel < size.x * size.y) {
      vec3 mean = mean_of(ivec2(pixel % size.x, pixel / size.x), layer);
      value |= uvec3(mean * 255.0 + 0.5) << (8 * i);
    }
  }
#else
  vec3 value = mean_of(ivec2(word % size.x, word / size.x), layer);
#endif
  int first = 3 * layer * plane_words + word;
  words[first] = value.r;
  words[first + plane_words] = value.g;
  words[first + 2 * plane_words] = value.b;
}

void main() {
  // Large images have more words than the limit on invocations.
  int invocations = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x), layer = int(gl_GlobalInvocationID.y);
  for (int word = int(gl_GlobalInvocationID.x); word < plane_words; word += invocations) resolve(word, layer);
}
)";

}  // namespace pictura::gl
