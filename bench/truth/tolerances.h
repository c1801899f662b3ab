// Tolerances for images, each with its reason. Channel values are in [0, 1].
#pragma once

namespace pictura {

/// Minimum pooled PSNR of the oracle against the truth, as promised by the design. Town-like scenes reach 61 dB, and
/// the truth's own error with 1,024 samples a pixel is about 68 dB.
constexpr double kMinOraclePsnr_db = 55.0;
/// Minimum PSNR of the worst single image, which shows little besides a dense horizon.
constexpr double kMinImagePsnr_db = 45.0;
/// Minimum gain over 2x2 supersampling, the paper's baseline.
constexpr double kOracleGain_db = 20.0;
/// Worst channel of the oracle on a lone cuboid before a wall: the design's promise. Coverage as alpha errs by up to
/// 64/255 there.
constexpr double kSharedEdgeError = 3.0 / 255;
/// Worst channel anywhere in the quality scenes: several partly covering objects share a pixel, and the visibility of
/// each has a resolution of 1/64.
constexpr double kWorstOracleError = 16.0 / 255;
/// Share of pixels whose planes may show another surface than the truth: a pixel's centre lies on an edge to within
/// rounding, or strips of two levels cross there and are ordered as a whole.
constexpr double kPlaneShare = 1e-3;
/// Relative error of the depth plane where both show the same kind of surface.
constexpr double kDepthError = 1e-3;
/// Visibility of an agent of 4 pixels or more: the design's promise. The truth's own error is about 0.005 there.
constexpr double kVisibilityError = 0.02;
/// A scene moved as a whole: single precision moves corners by about 1e-5 px for each 100 m from the origin; a sample
/// may change to the other side of an edge, which costs up to 1/64 of a pixel twice.
constexpr double kMovedSceneError = 8.0 / 255;
/// ... and the share of values that may change that much; the others change by rounding.
constexpr double kMovedSceneShare = 1e-3;
/// Sum of a box's faces against its silhouette, relative: exact except for rounding and for the up to 1e-3 of a pixel
/// at the border that counts as empty or full (kFullCoverage).
constexpr double kSilhouetteError = 3e-4;
/// A line in two pieces against the line in one, by channel: their common edge is split exactly, and the pieces' ends
/// are rounded to 1e-5 px.
constexpr double kSplitLineError = 1e-4;
/// The CUDA renderer against the oracle: the design's promise. Target: 0.
constexpr double kKernelError = 1.0 / 255;
constexpr double kKernelShareWithin = 0.9999;
constexpr double kKernelWorstError = 4.0 / 255;
/// ... and in relative depth, where both show the same surface: only rounding.
constexpr double kKernelDepthError = 1e-4;
/// Minimum pooled PSNR of the OpenGL baseline against the oracle on towns, by samples: the error of point samples.
/// About half a decibel below the tests' towns with Mesa's rasterizer, because sample positions and the rounding of
/// corners (to 1/256 of a pixel or finer) depend on the driver.
constexpr double kMinGlPsnr1_db = 24.0, kMinGlPsnr2x2_db = 31.7, kMinGlPsnrMsaa4_db = 34.4, kMinGlPsnr4x4_db = 39.0,
                 kMinGlPsnr8x8_db = 46.5;

/// Tolerance between two images of a golden scene (tests/golden): the worst value, the share of values that may exceed
/// the usual error, and the pooled PSNR. golden_test shows that seeded faults exceed each.
struct ImageTolerance {
  const char* name;
  double worst, usual, share_above_usual, min_psnr_db;
};
/// The oracle against its own images: its arithmetic is the same on every machine (docs/developer/house.md).
constexpr ImageTolerance kGoldenOracle{"oracle", 0, 0, 0, 0};
/// The CUDA renderer against the oracle's images: the design's promise, as above.
constexpr ImageTolerance kGoldenKernel{"kernel", kKernelWorstError, kKernelError, 1 - kKernelShareWithin, 0};
/// The oracle against the truth, in floats: the promised PSNR in every scene, without averaging over a town.
/// The worst value is 12/255.
constexpr ImageTolerance kGoldenTruth{"truth", kWorstOracleError, 1.0 / 255, 1, kMinOraclePsnr_db};
/// The same for images of a single pixel, in which dozens of objects share 64 samples and errors do not average out.
constexpr ImageTolerance kGoldenTruthOnePixel{"truth, one pixel", 10.0 / 255, 1.0 / 255, 1, 0};
/// The OpenGL baseline against the oracle's images, with kGoldenGlGrid squared samples a pixel, enough for an error
/// below that of any fault to detect. Measured with Mesa's rasterizer: 52.3 dB and 14/255 at worst; other drivers use
/// other sample positions and rounding.
constexpr int kGoldenGlGrid = 16;
constexpr ImageTolerance kGoldenGl{"gl", 24.0 / 255, 1.0 / 255, 1, 50};
constexpr ImageTolerance kGoldenGlOnePixel{"gl, one pixel", 12.0 / 255, 1.0 / 255, 1, 0};

}  // namespace pictura
