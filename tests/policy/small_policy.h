// Policies that are small enough for hundreds of passes.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura::test {

/// A policy whose layers have different widths, with patches of one pixel.
inline PolicySection tiny_section(Modality modality) {
  PolicySection c;
  c.modality = modality;
  c.patch_px = 1;
  c.conv_channels = {3, 4};
  c.conv_kernels = {3, 3};
  c.conv_strides = {2, 1};
  c.num_queries = 2;
  c.attention_heads = 2;
  c.attention_mlp = 5;
  c.embedding_width = 4;
  c.backbone_layers = 2;
  c.backbone_width = 6;
  return c;
}

/// A policy for the task of corridor.h.
inline PolicySection learning_section() {
  PolicySection c = tiny_section(Modality::vector);
  c.embedding_width = 8;
  c.backbone_width = 32;
  return c;
}

}  // namespace pictura::test
