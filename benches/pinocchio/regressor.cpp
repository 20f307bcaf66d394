// Seconds per sample of Pinocchio's computeJointTorqueRegressor on the chain of the TX40: what the
// crate's own regressor is set beside. The frames are those of tx40.toml.
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/multibody.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

int main() {
  using Eigen::Vector3d;
  const double right = 1.5707963267948966;
  const Vector3d origins[6] = {{0, 0, 0.320},    {0, 0, 0}, {0.225, 0, 0.035},
                               {0, -0.225, 0.0}, {0, 0, 0}, {0, 0, 0}};
  const Vector3d angles[6] = {{0, 0, 0},     {-right, 0, 0}, {0, 0, 0},
                              {right, 0, 0}, {-right, 0, 0}, {right, 2 * right, 0}};
  pinocchio::Model model;
  pinocchio::JointIndex parent = 0;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Matrix3d turned = (Eigen::AngleAxisd(angles[i][2], Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(angles[i][1], Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(angles[i][0], Vector3d::UnitX()))
                                       .toRotationMatrix();
    parent = model.addJoint(parent, pinocchio::JointModelRZ(),
                            pinocchio::SE3(turned, origins[i]), "q" + std::to_string(i + 1));
  }
  pinocchio::Data data(model);
  const int states = 1000, rounds = 200;
  std::vector<Eigen::VectorXd> q, v, a;
  for (int k = 0; k < states; ++k) {
    q.push_back(3.0 * Eigen::VectorXd::Random(model.nq));
    v.push_back(2.0 * Eigen::VectorXd::Random(model.nv));
    a.push_back(8.0 * Eigen::VectorXd::Random(model.nv));
  }
  double sum = 0.0, best = 1e9;
  for (int r = 0; r < rounds; ++r) {
    const auto began = std::chrono::steady_clock::now();
    for (int k = 0; k < states; ++k)
      sum += pinocchio::computeJointTorqueRegressor(model, data, q[k], v[k], a[k])(0, 0);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    best = std::min(best, took.count() / states);
  }
  std::fprintf(stderr, "checksum %g\n", sum);
  std::printf("%.9e\n", best);
}
