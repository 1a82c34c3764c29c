#include <meniscus/field/expression.kernel.h>

namespace meniscus::field {
namespace {

using Avx2 = xsimd::batch<double, xsimd::avx2>;

}  // namespace

extern const RunTape kRunTapeAvx2;
const RunTape kRunTapeAvx2 = kernel::run_tape<Avx2>;

}  // namespace meniscus::field
