#pragma once

/// \file
/// Published stress-stretch data of soft tissues, and the material of stiffening springs that is nearest to them.

#include "hybmss/material.hpp"
#include "studies/paper/table.hpp"

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss::tissue {

/// Nominal stress, Pa, by stretch; by the amount of shear gamma in the last test.
struct Test {
    std::string_view name;
    bool shear;
    std::vector<std::array<double, 2>> points;
};
struct Tissue {
    std::string_view preset; ///< material.preset of scenes; "" where there is none
    std::string_view name, source;
    std::vector<Test> tests;
};
const std::vector<Tissue>& tissues();

/// Of a bar along the axes of a lattice that is free across, or of simple shear in a plane of it: nominal stress, Pa.
double stress(const Material& material, bool shear, double deformation);

struct Fit {
    Material material;
    std::vector<double> r_squared; ///< of each test: 1 - sum of squared misfits over that about the mean
};
/// E, stiffening a and b by least squares over all points of the tests named, each by its test's greatest stress; nu is
/// given. By the Levenberg-Marquardt method of Eigen, within what stiffening is allowed.
Fit fit(const Tissue& tissue, double poisson_ratio, std::span<const std::size_t> tests);

/// Every tissue by all its tests at once, and by each of them alone.
paper::Table fit_table();
/// Point by point what the first fits make of the data.
paper::Table point_table();

} // namespace hybmss::tissue
