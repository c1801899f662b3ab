// Tolerances for images, each with its reason. Channel values are in [0, 1].
#pragma once

namespace pictura {

/// Minimum pooled PSNR of the oracle against the truth, as promised by the design. Town-like scenes reach 61 dB, and
/// the truth's own error with 1,024 samples per pixel is about 68 dB.
constexpr double kMinOraclePsnr_db = 55.0;
/// Minimum PSNR of the worst single image, which contains little besides a dense horizon.
constexpr double kMinImagePsnr_db = 45.0;
/// Minimum gain over 2x2 supersampling, the paper's baseline.
constexpr double kOracleGain_db = 20.0;
/// Maximum channel error of the oracle on a lone cuboid in front of a wall: the design's promise. Coverage as alpha has
/// errors of up to 64/255 there.
constexpr double kSharedEdgeError = 3.0 / 255;
/// Maximum channel error anywhere in the quality scenes: several partly covering objects share a pixel, and the
/// visibility of each has a resolution of 1/64.
constexpr double kWorstOracleError = 16.0 / 255;
/// Maximum share of pixels whose planes have another surface than the truth: the pixel's centre lies on an edge to
/// within rounding, or strips of two levels cross there and are ordered as a whole.
constexpr double kPlaneShare = 1e-3;
/// Maximum relative error of the depth plane at pixels where the truth has the same kind of surface.
constexpr double kDepthError = 1e-3;
/// Maximum visibility error of an agent of 4 pixels or more: the design's promise. The truth's own error is about 0.005
/// for these agents.
constexpr double kVisibilityError = 0.02;
/// Maximum channel error of a scene that is moved as a whole. Single precision moves corners by about 1e-5 px per 100 m
/// from the origin; a sample that changes to the other side of an edge costs up to 1/64 of a pixel twice.
constexpr double kMovedSceneError = 8.0 / 255;
/// Maximum share of a moved scene's values that change by more than rounding.
constexpr double kMovedSceneShare = 1e-3;
/// Maximum relative difference between the sum of a box's faces and its silhouette: exact except for rounding and for
/// the up to 1e-3 of a pixel at the border that counts as empty or full (kFullCoverage).
constexpr double kSilhouetteError = 3e-4;
/// Maximum channel difference between a line in two pieces and the same line in one: the common edge is split exactly,
/// and the ends of the pieces are rounded to 1e-5 px.
constexpr double kSplitLineError = 1e-4;
/// Tolerance of the CUDA renderer against the oracle: the design's promise. Target: 0.
constexpr double kKernelError = 1.0 / 255;
constexpr double kKernelShareWithin = 0.9999;
constexpr double kKernelWorstError = 4.0 / 255;
/// Maximum relative depth error of the CUDA renderer where both have the same surface: only rounding.
constexpr double kKernelDepthError = 1e-4;
/// Minimum pooled PSNR of the OpenGL baseline against the oracle on towns, by number of samples: the error of point
/// samples. The values are about half a decibel below those of the tests' towns with Mesa's rasterizer. Sample
/// positions and the rounding of corners (to 1/256 of a pixel or finer) depend on the driver.
constexpr double kMinGlPsnr1_db = 24.0, kMinGlPsnr2x2_db = 31.7, kMinGlPsnrMsaa4_db = 34.4, kMinGlPsnr4x4_db = 39.0,
                 kMinGlPsnr8x8_db = 46.5;

/// Tolerance between two images of a golden scene (tests/golden): the worst value, the share of values that may exceed
/// the usual error, and the pooled PSNR. golden_test verifies that seeded faults exceed each tolerance.
struct ImageTolerance {
  const char* name;
  double worst, usual, share_above_usual, min_psnr_db;
};
/// Tolerance of the oracle against its own images: its arithmetic is the same on every machine
/// (docs/developer/house.md).
constexpr ImageTolerance kGoldenOracle{"oracle", 0, 0, 0, 0};
/// Tolerance of the CUDA renderer against the oracle's images: the agreement that the design promises.
constexpr ImageTolerance kGoldenKernel{"kernel", kKernelWorstError, kKernelError, 1 - kKernelShareWithin, 0};
/// Tolerance of the oracle against the truth, in floats: the promised PSNR in every scene, without averaging over a
/// town. The worst value is 12/255.
constexpr ImageTolerance kGoldenTruth{"truth", kWorstOracleError, 1.0 / 255, 1, kMinOraclePsnr_db};
/// Tolerance for images of a single pixel, in which dozens of objects share 64 samples and errors do not average out.
constexpr ImageTolerance kGoldenTruthOnePixel{"truth, one pixel", 10.0 / 255, 1.0 / 255, 1, 0};
/// Tolerance of the OpenGL baseline against the oracle's images, with kGoldenGlGrid squared samples per pixel, enough
/// for an error below that of any fault to detect. Measured with Mesa's rasterizer: 52.3 dB and at worst 14/255; other
/// drivers use other sample positions and rounding.
constexpr int kGoldenGlGrid = 16;
constexpr ImageTolerance kGoldenGl{"gl", 24.0 / 255, 1.0 / 255, 1, 50};
constexpr ImageTolerance kGoldenGlOnePixel{"gl, one pixel", 12.0 / 255, 1.0 / 255, 1, 0};

}  // namespace pictura
