// Video writer that sends raw frames to ffmpeg.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/image.h"

namespace pictura {

/// Writes a .mp4 (H.264, yuv420p) or .gif (one palette per video). The file appears when finish() returns; an
/// unfinished video leaves no file. An odd side of an .mp4 loses its last row or column. Use an object in one thread
/// only.
class VideoWriter {
 public:
  /// Throws UsageError for other extensions, and Error if the folder is not writable or ffmpeg does not start.
  VideoWriter(const std::string& path, int width_px, int height_px, double frames_per_s);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Throws Error if the frame has another size. If ffmpeg has ended, throws Error with its last line of output.
  void add(const RgbImage& frame);
  /// Completes the file. Throws Error if ffmpeg failed or no frame was added.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pictura
