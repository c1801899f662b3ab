#include "pictura/backend_gl/gl_functions.h"

#include "pictura/common/error.h"

namespace pictura::gl {

Functions::Functions(const Context& context) {
#define PICTURA_GL_LOOK_UP(function)                                                    \
  function = reinterpret_cast<decltype(function)>(context.entry_point("gl" #function)); \
  PICTURA_CHECK(function, "renderer {}: the library has no gl" #function "; OpenGL 4.5 is needed", context.name());
  PICTURA_GL_FUNCTIONS(PICTURA_GL_LOOK_UP)
#undef PICTURA_GL_LOOK_UP
}

}  // namespace pictura::gl
