// Video: frames of raw pixels piped into the ffmpeg program.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/image.h"

namespace pictura {

/// Writer of a video, frame by frame; the file appears under its name when finish() returns. The extension selects the
/// format: .mp4 (H.264, yuv420p; an odd side loses its last row or column) or .gif (one palette per video).
/// Single-threaded; an unfinished video leaves no file.
class VideoWriter {
 public:
  /// Throws UsageError for another extension, and Error when the folder is not writable or ffmpeg cannot be started.
  VideoWriter(const std::string& path, int width_px, int height_px, double frames_per_s);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Adds a frame. Throws Error when the frame has another size, or with ffmpeg's last line if ffmpeg has ended.
  void add(const RgbImage& frame);
  /// Completes the video and moves it to its name. Throws Error when ffmpeg failed or there is no frame.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pictura
