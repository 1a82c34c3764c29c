#include <meniscus/field/blobs.kernel.h>

namespace meniscus::field {
namespace {

using Avx2 = xsimd::batch<double, xsimd::avx2>;

}  // namespace

const SumBlobsTable kSumBlobsAvx2 = MENISCUS_SUM_BLOBS_TABLE(Avx2);

}  // namespace meniscus::field
