// Tolerances for images, each with its reason. The oracle is the CPU renderer; the truth is the ray caster of
// image_truth.h. Channel values are in [0, 1].
#pragma once

namespace pictura {

/// Minimum pooled PSNR of the oracle against the truth, as the design requires. Town-like scenes reach 61 dB. The
/// truth, with 1,024 samples per pixel, has a PSNR of about 68 dB itself.
constexpr double kMinOraclePsnr_db = 55.0;
/// Minimum PSNR of a single image. The worst image contains little besides a dense horizon.
constexpr double kMinImagePsnr_db = 45.0;
/// Minimum difference between the oracle's PSNR and the PSNR of 2x2 supersampling, the baseline of the Pictura paper.
constexpr double kOracleGain_db = 20.0;
/// Maximum channel error of the oracle on a lone cuboid in front of a wall, as the design requires. With coverage as
/// alpha, errors there are up to 64/255.
constexpr double kSharedEdgeError = 3.0 / 255;
/// Maximum channel error of the oracle in the scenes that measure quality. Several objects may partly cover one pixel,
/// and the visibility of each object has a resolution of 1/64.
constexpr double kWorstOracleError = 16.0 / 255;
/// Maximum share of pixels whose planes (depth, class, instance) show another surface than the truth. At such pixels,
/// the centre is within rounding errors of an edge, or strips of two levels cross and are ordered as a whole.
constexpr double kPlaneShare = 1e-3;
/// Maximum relative error of the depth plane at pixels where the truth has the same kind of surface.
constexpr double kDepthError = 1e-3;
/// Maximum error of the visibility of an agent that covers 4 pixels or more, as the design requires. The error of the
/// truth is about 0.005 for these agents.
constexpr double kVisibilityError = 0.02;
/// Maximum change of a channel when a scene is moved as a whole. Single precision moves corners by about 1e-5 px per
/// 100 m of distance from the origin. If a sample changes to the other side of an edge, two faces each change by up to
/// 1/64 of a pixel.
constexpr double kMovedSceneError = 8.0 / 255;
/// Maximum share of a moved scene's values that change by more than rounding.
constexpr double kMovedSceneShare = 1e-3;
/// Maximum relative difference between the summed coverage of a box's faces and the coverage of the box's silhouette.
/// They are equal except for rounding, and for border pixels that count as full although up to 1e-3 of them is
/// uncovered (kFullCoverage).
constexpr double kSilhouetteError = 3e-4;
/// Maximum channel difference between a line of two pieces and the same line of one piece. The common edge of the
/// pieces splits pixels exactly, and the ends of the pieces are rounded to 1e-5 px.
constexpr double kSplitLineError = 1e-4;
/// Tolerances of the CUDA renderer against the oracle, as the design requires. The target is 0. At least the share
/// kKernelShareWithin of all values must have an error of at most kKernelError.
constexpr double kKernelError = 1.0 / 255;
constexpr double kKernelShareWithin = 0.9999;
constexpr double kKernelWorstError = 4.0 / 255;
/// Maximum relative depth error of the CUDA renderer against the oracle where both show the same surface. Only rounding
/// differs.
constexpr double kKernelDepthError = 1e-4;
/// Minimum pooled PSNR of the OpenGL renderer against the oracle on towns, by number of samples per pixel. Its error is
/// mainly that of point samples. The values are about 0.5 dB below those of the tests' towns with Mesa's rasterizer,
/// because sample positions and the rounding of corners (to 1/256 of a pixel or finer) depend on the driver.
constexpr double kMinGlPsnr1_db = 24.0, kMinGlPsnr2x2_db = 31.7, kMinGlPsnrMsaa4_db = 34.4, kMinGlPsnr4x4_db = 39.0,
                 kMinGlPsnr8x8_db = 46.5;

/// Tolerance between two images of a golden scene (tests/golden): the maximum error of a value, the usual error, the
/// share of values that may exceed the usual error, and the minimum pooled PSNR. golden_test verifies that images with
/// deliberate faults exceed each tolerance.
struct ImageTolerance {
  const char* name;
  double worst, usual, share_above_usual, min_psnr_db;
};
/// Tolerance of the oracle against its stored images: 0, because its arithmetic is the same on every machine
/// (docs/developer/house.md).
constexpr ImageTolerance kGoldenOracle{"oracle", 0, 0, 0, 0};
/// Tolerance of the CUDA renderer against the oracle's images, as the design requires.
constexpr ImageTolerance kGoldenKernel{"kernel", kKernelWorstError, kKernelError, 1 - kKernelShareWithin, 0};
/// Tolerance of the oracle against the truth, in floats. Every scene must have the required PSNR by itself, without
/// averaging over a town. The largest measured error is 12/255.
constexpr ImageTolerance kGoldenTruth{"truth", kWorstOracleError, 1.0 / 255, 1, kMinOraclePsnr_db};
/// Tolerance for images of a single pixel, in which dozens of objects share 64 samples and errors do not average out.
constexpr ImageTolerance kGoldenTruthOnePixel{"truth, one pixel", 10.0 / 255, 1.0 / 255, 1, 0};
/// Tolerance of the OpenGL renderer against the oracle's images. The renderer takes kGoldenGlGrid^2 samples per pixel,
/// so that its error is below that of any fault that the test must detect. With Mesa's rasterizer, the PSNR is 52.3 dB
/// and the largest error is 14/255. Other drivers use other sample positions and rounding.
constexpr int kGoldenGlGrid = 16;
constexpr ImageTolerance kGoldenGl{"gl", 24.0 / 255, 1.0 / 255, 1, 50};
constexpr ImageTolerance kGoldenGlOnePixel{"gl, one pixel", 12.0 / 255, 1.0 / 255, 1, 0};

}  // namespace pictura
