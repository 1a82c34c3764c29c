// Eigen has no AVX-512 without fused multiply-add, and nothing here needs its packets.
#define EIGEN_DONT_VECTORIZE
#if defined(__GNUC__) && !defined(__clang__)
// The compiler's own intrinsics start from registers that are left undefined on purpose.
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <meniscus/field/blobs.kernel.h>

namespace meniscus::field {
namespace {

using Avx512 = xsimd::batch<double, xsimd::avx512f>;

}  // namespace

const BlobKernels kBlobsAvx512 = kernel::table<Avx512>();

}  // namespace meniscus::field
