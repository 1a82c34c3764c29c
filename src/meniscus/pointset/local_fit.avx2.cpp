#include <meniscus/pointset/local_fit.kernel.h>

namespace meniscus::pointset::fit_kernel {

void solve_avx2(const Row* rows, std::size_t count, double gradient, const double* regular, double (*solution)[kLanes]) {
  solve(rows, count, gradient, regular, solution);
}

}  // namespace meniscus::pointset::fit_kernel
