// How far apart images may be, each with its reason. Channel values are in [0, 1].
#pragma once

namespace pictura {

/// Least pooled PSNR of the oracle against the truth. The design's promise; 61 dB is what town-like scenes measure, and
/// the truth's own error with 1,024 samples a pixel is about 68 dB.
constexpr double kMinOraclePsnr_db = 55.0;
/// Least PSNR of the worst single image: an image that shows little but one crowded horizon.
constexpr double kMinImagePsnr_db = 45.0;
/// 2x2 supersampling, the bar that the paper compares with, must stay this far behind.
constexpr double kOracleGain_db = 20.0;
/// Worst channel of the oracle on a lone cuboid before a wall: the design's promise. Coverage taken for alpha errs by
/// up to 64/255 there.
constexpr double kSharedEdgeError = 3.0 / 255;
/// Worst channel anywhere in the quality scenes: several partly covered things share a pixel, and visibility is known
/// to 1/64 of each.
constexpr double kWorstOracleError = 16.0 / 255;
/// Share of pixels whose planes may tell of another surface than the truth: a pixel's centre lies on an edge to within
/// rounding, or strips of two levels cross there and are ordered as wholes.
constexpr double kPlaneShare = 1e-3;
/// Relative error of the depth plane where both tell of the same kind of surface.
constexpr double kDepthError = 1e-3;
/// Visibility of an agent of 4 pixels or more: the design's promise. The truth's own error is about 0.005 there.
constexpr double kVisibilityError = 0.02;
/// A scene moved as a whole: single precision moves corners by about 1e-5 px for each 100 m from the origin; a sample
/// may fall to the other side of an edge, worth up to 1/64 of a pixel twice.
constexpr double kMovedSceneError = 8.0 / 255;
/// ... and only few values may change that much; the others by rounding.
constexpr double kMovedSceneShare = 1e-3;
/// Sum of a box's faces against its silhouette, relative: exact but for rounding and for the up to 1e-3 of a pixel at
/// the border that is taken for nothing or for all of it (kFullCoverage).
constexpr double kSilhouetteError = 3e-4;
/// A line in two pieces against the line in one, by channel: their common edge is split exactly, and the pieces' ends
/// are rounded to 1e-5 px.
constexpr double kSplitLineError = 1e-4;
/// The CUDA renderer against the oracle: the design's promise. Aim: 0.
constexpr double kKernelError = 1.0 / 255;
constexpr double kKernelShareWithin = 0.9999;
constexpr double kKernelWorstError = 4.0 / 255;
/// ... and in relative depth, where both tell of the same surface: rounding alone.
constexpr double kKernelDepthError = 1e-4;
/// Least pooled PSNR of the OpenGL baseline against the oracle on towns, by its samples: what point samples miss of the
/// coverage. About half a decibel below what the towns of the tests measure with Mesa's rasterizer, because drivers
/// place samples and round corners to parts of a pixel (1/256 at least) as they like.
constexpr double kMinGlPsnr1_db = 24.0, kMinGlPsnr2x2_db = 31.7, kMinGlPsnrMsaa4_db = 34.4, kMinGlPsnr4x4_db = 39.0,
                 kMinGlPsnr8x8_db = 46.5;

/// How far a golden scene's images (tests/golden) may be from others of it: the worst value, the share of values that
/// may be further off than usual, and the pooled PSNR. golden_test shows that seeded faults are beyond each.
struct ImageTolerance {
  const char* name;
  double worst, usual, share_above_usual, min_psnr_db;
};
/// The oracle against its own pictures: its arithmetic is the same on every machine (docs/house.md).
constexpr ImageTolerance kGoldenOracle{"oracle", 0, 0, 0, 0};
/// The CUDA renderer against the oracle's pictures: the design's promise, as above.
constexpr ImageTolerance kGoldenKernel{"kernel", kKernelWorstError, kKernelError, 1 - kKernelShareWithin, 0};
/// The oracle against the truth, in floats: the promised PSNR in every scene, where there is no town to average over.
/// The worst value is 12/255.
constexpr ImageTolerance kGoldenTruth{"truth", kWorstOracleError, 1.0 / 255, 1, kMinOraclePsnr_db};
/// The same for images of a single pixel, in which dozens of things share 64 samples and nothing averages out.
constexpr ImageTolerance kGoldenTruthOnePixel{"truth, one pixel", 10.0 / 255, 1.0 / 255, 1, 0};
/// The OpenGL baseline against the oracle's pictures, with so many samples squared in a pixel that what they miss is
/// less than any fault that is to be seen. Measured with Mesa's rasterizer: 52.3 dB and 14/255 at worst; other drivers
/// place samples and round corners differently.
constexpr int kGoldenGlGrid = 16;
constexpr ImageTolerance kGoldenGl{"gl", 24.0 / 255, 1.0 / 255, 1, 50};
constexpr ImageTolerance kGoldenGlOnePixel{"gl, one pixel", 12.0 / 255, 1.0 / 255, 1, 0};

}  // namespace pictura
