#include <meniscus/pointset/point_set_field.kernel.h>

namespace meniscus::pointset::field_kernel {

const Sum kSumAvx2[3] = {sum<0>, sum<1>, sum<2>};

}  // namespace meniscus::pointset::field_kernel
