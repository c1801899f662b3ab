// Tolerances for images. The oracle is the CPU renderer; the truth is the ray caster of image_truth.h. Channel values
// are in [0, 1].
#pragma once

namespace pictura {

/// Minimum pooled PSNR of the oracle against the truth, as the design requires.
constexpr double kMinOraclePsnr_db = 55.0;
/// Minimum PSNR of a single image.
constexpr double kMinImagePsnr_db = 45.0;
/// Minimum PSNR gain of the oracle over 2x2 supersampling, the baseline of the Pictura paper.
constexpr double kOracleGain_db = 20.0;
/// Maximum channel error of the oracle on a lone cuboid in front of a wall, as the design requires.
constexpr double kSharedEdgeError = 3.0 / 255;
/// Maximum channel error of the oracle in the quality scenes, where several objects partly cover a pixel.
constexpr double kWorstOracleError = 16.0 / 255;
/// Maximum share of pixels whose planes (depth, class, instance) show another surface than the truth. Such pixels are
/// at edges, or where strips of two levels cross.
constexpr double kPlaneShare = 1e-3;
/// Maximum relative depth error at pixels where the truth has the same kind of surface.
constexpr double kDepthError = 1e-3;
/// Maximum error of the visibility of an agent of 4 pixels or more, as the design requires.
constexpr double kVisibilityError = 0.02;
/// Maximum change of a channel when a whole scene is moved. Corners move by about 1e-5 px per 100 m from the origin. A
/// sample that moves across an edge changes the coverage of two faces by up to 1/64 of a pixel.
constexpr double kMovedSceneError = 8.0 / 255;
/// Maximum share of a moved scene's values that change by more than rounding.
constexpr double kMovedSceneShare = 1e-3;
/// Maximum relative difference between the summed coverage of a box's faces and that of its silhouette. Border pixels
/// may count as full (kFullCoverage).
constexpr double kSilhouetteError = 3e-4;
/// Maximum channel difference between a line of two pieces and the same line of one piece.
constexpr double kSplitLineError = 1e-4;
/// Tolerances of the CUDA renderer against the oracle, as the design requires. The share kKernelShareWithin of all
/// values must have an error of at most kKernelError.
constexpr double kKernelError = 1.0 / 255;
constexpr double kKernelShareWithin = 0.9999;
constexpr double kKernelWorstError = 4.0 / 255;
/// Maximum relative depth error of the CUDA renderer against the oracle where both show the same surface.
constexpr double kKernelDepthError = 1e-4;
/// Minimum pooled PSNR of the OpenGL renderer against the oracle on towns, by samples per pixel. Mesa's rasterizer
/// exceeds the values by about 0.5 dB, but results depend on the driver.
constexpr double kMinGlPsnr1_db = 24.0, kMinGlPsnr2x2_db = 31.7, kMinGlPsnrMsaa4_db = 34.4, kMinGlPsnr4x4_db = 39.0,
                 kMinGlPsnr8x8_db = 46.5;

/// Tolerance between two images of a golden scene (tests/golden): maximum error, usual error, share of values that may
/// exceed the usual error, and minimum pooled PSNR. golden_test verifies that deliberate faults exceed each tolerance.
struct ImageTolerance {
  const char* name;
  double worst, usual, share_above_usual, min_psnr_db;
};
/// Tolerance of the oracle against its stored images: 0, because its arithmetic is the same on every machine.
constexpr ImageTolerance kGoldenOracle{"oracle", 0, 0, 0, 0};
/// Tolerance of the CUDA renderer against the oracle's images, as the design requires.
constexpr ImageTolerance kGoldenKernel{"kernel", kKernelWorstError, kKernelError, 1 - kKernelShareWithin, 0};
/// Tolerance of the oracle against the truth, in floats. Every scene must have the required PSNR by itself.
constexpr ImageTolerance kGoldenTruth{"truth", kWorstOracleError, 1.0 / 255, 1, kMinOraclePsnr_db};
/// Tolerance for images of one pixel, in which dozens of objects share 64 samples.
constexpr ImageTolerance kGoldenTruthOnePixel{"truth, one pixel", 10.0 / 255, 1.0 / 255, 1, 0};
/// Tolerance of the OpenGL renderer against the oracle's images. With kGoldenGlGrid^2 samples per pixel, its error is
/// below that of any fault that the test must detect. Mesa's rasterizer has a PSNR of 52.3 dB and a largest error of
/// 14/255.
constexpr int kGoldenGlGrid = 16;
constexpr ImageTolerance kGoldenGl{"gl", 24.0 / 255, 1.0 / 255, 1, 50};
constexpr ImageTolerance kGoldenGlOnePixel{"gl, one pixel", 12.0 / 255, 1.0 / 255, 1, 0};

}  // namespace pictura
