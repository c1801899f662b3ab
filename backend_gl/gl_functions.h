// The OpenGL 4.5 functions that this folder uses, loaded from a context's library.
#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include "pictura/backend_gl/gl_context.h"

namespace pictura::gl {

// clang-format off
#define PICTURA_GL_FUNCTIONS(X) \
  X(AttachShader) X(BindBufferBase) X(BindFramebuffer) X(BindTextureUnit) X(BindVertexArray) \
  X(CheckNamedFramebufferStatus) X(ClearNamedFramebufferfv) X(ClipControl) X(CompileShader) X(CreateBuffers) \
  X(CreateFramebuffers) X(CreateProgram) X(CreateShader) X(CreateTextures) X(CreateVertexArrays) \
  X(DeleteBuffers) X(DeleteFramebuffers) X(DeleteProgram) X(DeleteShader) X(DeleteTextures) \
  X(DepthFunc) X(DispatchCompute) X(DrawArraysInstancedBaseInstance) X(Enable) \
  X(EnableVertexArrayAttrib) X(GetError) X(GetIntegerv) X(GetProgramInfoLog) X(GetProgramiv) X(GetShaderInfoLog) \
  X(GetShaderiv) X(GetString) X(GetStringi) X(GetTextureLevelParameteriv) X(GetUniformLocation) X(LinkProgram) \
  X(MapNamedBufferRange) X(MemoryBarrier) X(NamedBufferData) X(NamedBufferStorage) \
  X(NamedFramebufferTexture) X(ProgramUniform1f) X(ProgramUniform1i) X(ProgramUniform2f) X(ProgramUniform2i) \
  X(ProgramUniform4f) X(ShaderSource) X(TextureStorage3D) X(TextureStorage3DMultisample) X(UnmapNamedBuffer) \
  X(UseProgram) X(VertexArrayAttribBinding) X(VertexArrayAttribFormat) X(VertexArrayAttribIFormat) \
  X(VertexArrayBindingDivisor) X(VertexArrayVertexBuffer) X(Viewport)
// clang-format on

struct Functions {
#define PICTURA_GL_DECLARE(name) decltype(&::gl##name) name = nullptr;
  PICTURA_GL_FUNCTIONS(PICTURA_GL_DECLARE)
#undef PICTURA_GL_DECLARE

  /// Throws Error naming a function that the context lacks.
  explicit Functions(const Context& context);

  int integer(GLenum name) const {
    GLint value = 0;
    GetIntegerv(name, &value);
    return value;
  }
};

}  // namespace pictura::gl
