// Renderers by name: the one file that knows every backend.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// "cpu", "cuda", "gl" (one of the next two: EGL where it gives a context, else OSMesa), "gl:egl", "gl:osmesa", "null"
/// (draws black: for running the rest without a renderer), or "auto": cuda where config.device is a CUDA device and one
/// is found, else cpu; `choice_out`, if given, receives what was chosen and why, and where the kernels of `cuda` come
/// from. Where config.device is the host, `cuda` copies scenes to the device and images back. Throws UsageError listing
/// the known names; Error when the backend cannot run here.
std::unique_ptr<Renderer> make_renderer(const std::string& name, const RendererConfig& config,
                                        std::string* choice_out = nullptr);

/// Names that this build knows, in the order that messages list them.
std::vector<std::string> renderer_names();

}  // namespace pictura
