#include <meniscus/field/blobs.kernel.h>

namespace meniscus::field {
namespace {

using Avx2 = xsimd::batch<double, xsimd::avx2>;

}  // namespace

const BlobKernels kBlobsAvx2 = kernel::table<Avx2>();

}  // namespace meniscus::field
