#include <meniscus/field/primitives.kernel.h>

namespace meniscus::field {
namespace {

using Avx2 = xsimd::batch<double, xsimd::avx2>;

}  // namespace

extern const ShapeTable kShapesAvx2;
const ShapeTable kShapesAvx2 = MENISCUS_SHAPE_TABLE(Avx2);

}  // namespace meniscus::field
