#include <meniscus/field/combine.kernel.h>

namespace meniscus::field {

const Fold kFoldAvx2 = kernel::fold<xsimd::batch<double, xsimd::avx2>>;

}  // namespace meniscus::field
