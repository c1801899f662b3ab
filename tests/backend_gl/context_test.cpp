// Libraries and contexts: errors for missing libraries, and restoration of a thread's previous context.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backend_gl/gl_context.h"
#include "pictura/common/error.h"
#include "pictura/tests/backend_gl/gl_support.h"

namespace pictura::gl {
namespace {

TEST(GlContext, AMissingLibraryNamesItsDebianPackage) {
  try {
    SharedLibrary("gl:osmesa", "libNotThere.so.8", "Debian package libosmesa6");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr("renderer gl:osmesa"), testing::HasSubstr("libNotThere.so.8"),
                               testing::HasSubstr("Debian package libosmesa6")));
  }
}

TEST(GlContext, AMissingFunctionIsNamed) {
  const SharedLibrary library("gl:egl", "libc.so.6", "libc6");
  EXPECT_NE(library.function("malloc"), nullptr);
  try {
    library.function("eglNotThere");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("libc.so.6 has no function eglNotThere"));
  }
}

// A renderer that draws while another context is current restores that context.
template <typename Context>
void expect_left_current(gl::Context* outer, const char* file, const char* package, const char* get_current,
                         const std::string& backend) {
  const SharedLibrary library(backend, file, package);
  const auto current = reinterpret_cast<Context (*)()>(library.function(get_current));
  const Context before = current();
  {
    const CurrentContext entered(outer);
    const Context ours = current();
    EXPECT_NE(ours, before);
    const Snapshot town = make_synthetic_town(1, 10);
    EXPECT_FALSE(draw(backend, town.geometry, town.scene, town.views, {.num_threads = 1}).empty());
    EXPECT_EQ(current(), ours);
  }
  EXPECT_EQ(current(), before);
}

TEST(GlContext, RestoresThePreviousContextAndApi) {
  const std::string no_osmesa = missing("gl:osmesa"), no_egl = missing("gl:egl");
  if (no_osmesa.empty()) {
    expect_left_current<void*>(make_osmesa_context().get(), "libOSMesa.so.8", "libosmesa6", "OSMesaGetCurrentContext",
                               "gl:osmesa");
  }
  if (no_egl.empty()) {
    // EGL's queries refer to the bound API: a renderer binds OpenGL while it draws and restores the previous one.
    const SharedLibrary library("gl:egl", "libEGL.so.1", "libegl1");
    const auto query_api = reinterpret_cast<unsigned (*)()>(library.function("eglQueryAPI"));
    const unsigned api = query_api();
    expect_left_current<void*>(make_egl_context().get(), "libEGL.so.1", "libegl1", "eglGetCurrentContext", "gl:egl");
    EXPECT_EQ(query_api(), api);
  }
  if (!no_osmesa.empty() && !no_egl.empty()) GTEST_SKIP() << no_osmesa << "; " << no_egl;
}

}  // namespace
}  // namespace pictura::gl
