// Work and precision: the parts that the tables of `hybmss-study price` are made of.

#include "simulation/accuracy/mesh_convergence.hpp"
#include "studies/price/points.hpp"
#include "studies/price/price_tables.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hybmss::price {
namespace {

GridField filled(const std::array<int, 3>& cells, double h,
                 const std::function<std::array<double, 3>(double, double, double)>& f) {
    GridField field{cells, h, {}};
    for (int k = 0; k <= cells[2]; ++k) {
        for (int j = 0; j <= cells[1]; ++j) {
            for (int i = 0; i <= cells[0]; ++i) {
                field.values.push_back(f(i * h, j * h, k * h));
            }
        }
    }
    return field;
}

TEST(Price, LinearFieldsAreRefinedExactly) {
    const auto linear = [](double x, double y, double z) { return std::array{1 + 2 * x - y, x * y * z, z - 3 * x}; };
    // x y z is trilinear: exact inside one cell only where all of it is, as here.
    const GridField coarse = filled({2, 3, 1}, 0.5, linear), fine = filled({8, 12, 4}, 0.125, linear);
    const FieldError error = field_error(coarse.refined(4), fine);
    EXPECT_LT(error.l2, 1e-14);
    EXPECT_LT(error.h1, 1e-13);
    EXPECT_EQ(fine.coarsened(4).values, coarse.values);
}

TEST(Price, QuadraticElementsAreRefinedExactly) {
    const auto quadratic = [](double x, double y, double z) {
        return std::array{1 + x * x - y * z, x * y * z + z * z, 2 * y * y - x};
    };
    const auto mesh = calculix::brick_mesh(Lattice::box(2, 1, 2, 0.5), calculix::ElementType::c3d20);
    std::vector<std::array<double, 3>> u;
    for (const auto& x : mesh.rest) {
        u.push_back(quadratic(x[0], x[1], x[2]));
    }
    const FieldError error = field_error(refined_quadratic(mesh, u, {2, 1, 2}, 4), filled({8, 4, 8}, 0.125, quadratic));
    EXPECT_LT(error.l2, 1e-14);
    EXPECT_LT(error.h1, 1e-13);
}

TEST(Price, FieldErrorsAreNorms) {
    const auto wave = [](double x, double, double) { return std::array{std::sin(x), 0.0, 0.0}; };
    const GridField field = filled({64, 1, 1}, 1.0 / 64, wave);
    const FieldError error = field_error(combined(1.25, field, 0, field), field);
    EXPECT_NEAR(error.l2, 0.25, 1e-12);
    EXPECT_NEAR(error.h1, 0.25, 1e-12);
    EXPECT_THROW(field_error(field, field.refined(2)), std::invalid_argument);
}

TEST(Price, ExtrapolationFindsTheLimit) {
    std::vector<double> values;
    for (const double h : {1.0, 0.5, 0.25, 0.125}) {
        values.push_back(3 + 0.2 * std::pow(h, 1.4));
    }
    const Extrapolation found = extrapolate(values, 2);
    EXPECT_NEAR(found.value, 3, 1e-12);
    EXPECT_NEAR(found.order, 1.4, 1e-10);
    EXPECT_LT(found.uncertainty, 1e-12);
    EXPECT_THROW(extrapolate({1, 2, 3}, 2), std::invalid_argument);
}

// Williams 1952 and later tables, plane strain: 0.7112 at 0.3; the incompressible 0.5946; none at 0.
TEST(Price, ClampedEdgeHasItsExponent) {
    EXPECT_NEAR(clamped_edge_exponent(0.3), 0.7112, 1e-4);
    EXPECT_NEAR(clamped_edge_exponent(0.5), 0.5946, 1e-4);
    EXPECT_NEAR(clamped_edge_exponent(0), 1, 1e-9);
}

TEST(Price, CostsLieOnLinesBetweenPoints) {
    const Way way, other{calculix::ElementType::c3d20};
    std::vector<Point> points;
    for (const auto& [across, seconds, error] : {std::tuple(2, 1.0, 0.1), {4, 10.0, 0.01}, {8, 100.0, 0.004}}) {
        points.push_back({way, paper::Kind::shear, across, {}, seconds, 0, {}, {error, error, error}});
        points.push_back({other, paper::Kind::shear, across, {}, 1e-3, 0, {}, {1e-9, 1e-9, 1e-9}});
    }
    EXPECT_DOUBLE_EQ(cost_at(points, way, 0, 0.5).seconds, 1); // the coarsest mesh is good enough
    const Cost between = cost_at(points, way, 1, 0.1 / std::sqrt(10.0));
    EXPECT_NEAR(between.seconds, std::sqrt(10.0), 1e-12);
    EXPECT_NEAR(between.across, std::sqrt(8.0), 1e-12);
    EXPECT_NEAR(cost_at(points, way, 2, 0.004).seconds, 100, 1e-9);
    EXPECT_TRUE(std::isnan(cost_at(points, way, 0, 0.003).seconds));
}

// CalculiX stands beside the static solves of both forms: here each goes as 1 : 10 from an error of 10 % to one of 1 %.
TEST(Price, CalculiXStandsBesideBothFormsAtEqualError) {
    Solutions solutions;
    Reference& reference = solutions.references.emplace_back();
    reference.kind = paper::Kind::torsion;
    reference.values = {{1, 1.4, 0}};
    std::vector<Point>& points = solutions.points.emplace_back();
    const auto add = [&](const Way& way, int across, double seconds, double error) {
        points.push_back({way, reference.kind, across, {}, seconds, 0, {1 + error}, {error, error, error}});
    };
    for (const auto& [model, start] : {std::pair(paper::Model::hybmss, 1.0), {paper::Model::hybmss_m, 0.01}}) {
        const Way way{{}, Method::static_solve, model, Precision::float64};
        add(way, 2, start, 0.1);
        add(way, 4, 10 * start, 0.01);
    }
    add({calculix::ElementType::c3d20}, 2, 5 * std::sqrt(10.0), 0.1 / std::sqrt(10.0));
    for (const paper::Table& table : solution_tables(solutions)) {
        if (table.name != "calculix") {
            continue;
        }
        ASSERT_EQ(table.rows.size(), 3u); // torque, L2, H1
        for (const std::vector<paper::Cell>& row : table.rows) {
            ASSERT_EQ(row.size(), table.columns.size());
            for (std::size_t c = 0; c < row.size(); ++c) {
                if (table.columns[c].key == "ratio_double") {
                    EXPECT_NEAR(row[c].number, 5, 1e-9);
                } else if (table.columns[c].key == "ratio_m_double") {
                    EXPECT_NEAR(row[c].number, 500, 1e-7);
                }
            }
        }
        ASSERT_EQ(table.remarks.size(), 2u);
        EXPECT_NE(table.remarks[0].find("takes 5 times"), std::string::npos) << table.remarks[0];
        EXPECT_NE(table.remarks[1].find("500 times"), std::string::npos) << table.remarks[1];
        EXPECT_NE(table.remarks[1].find("HybMSS-M"), std::string::npos) << table.remarks[1];
        return;
    }
    FAIL() << "no table \"calculix\"";
}

// On coarse meshes already the errors of the static solve fall with the order that the clamped edges allow.
TEST(Price, ObservedOrdersAreThoseOfTheClampedEdges) {
    const Reference reference = make_reference(paper::Kind::compression, 16, [](const std::string&) {});
    EXPECT_LT(reference.values[0].uncertainty, 2e-3);
    Extent extent;
    extent.reference = 16;
    extent.finest = 8;
    extent.calculix = false;
    const std::vector<Point> points = measure_points(reference, extent, [](const std::string&) {});
    const auto point = [&](int across, Method method) {
        for (const Point& p : points) {
            if (p.across == across && p.way == Way{{}, method, paper::Model::hybmss, Precision::float64}) {
                return p;
            }
        }
        throw std::logic_error("no such point");
    };
    const Point coarse = point(4, Method::static_solve), fine = point(8, Method::static_solve);
    for (const std::size_t index : {0u, 1u, 2u}) { // force, e, L2
        EXPECT_NEAR(std::log2(coarse.errors[index] / fine.errors[index]), reference.expected_order, 0.2) << index;
    }
    EXPECT_GT(std::log2(coarse.errors[3] / fine.errors[3]), 0.6); // H1
    // All ways come to rest at the same place.
    for (const Method method :
         {Method::static_solve, Method::settling, Method::paper_settling, Method::implicit_settling}) {
        EXPECT_NEAR(point(8, method).errors[0], fine.errors[0], 0.03 * fine.errors[0]) << name(method);
    }
}

TEST(Price, SpringsOnMeansErrLessOnTheSameMesh) {
    for (const auto& [kind, most] :
         {std::pair(paper::Kind::shear, 0.7), {paper::Kind::torsion, 0.5}, {paper::Kind::beam, 0.1}}) {
        const double limit = make_reference(kind, 16, [](const std::string&) {}).values[0].value;
        const auto error = [&, kind = kind](paper::Model model) {
            return std::abs(solve_lattice(kind, 4, model, Method::static_solve, Precision::float64).values[0] / limit -
                            1);
        };
        EXPECT_LT(error(paper::Model::hybmss_m), most * error(paper::Model::hybmss)) << paper::name(kind);
    }
}

TEST(Price, TimeStepsAreOfTheirOrders) {
    const std::vector<TimeStepPoint> points = measure_time_steps(2, [](const std::string&) {});
    ASSERT_EQ(points.size(), 16u);
    // Displacements have leapfrog's order only where the waves of the start are followed: these steps are the largest.
    const auto expect_order = [&](std::size_t first, SolverMethod method, bool damped, double order) {
        const TimeStepPoint &large = points[first], &small = points[first + 1];
        EXPECT_EQ(large.method, method);
        EXPECT_EQ(large.damped, damped);
        EXPECT_NEAR(std::log2(large.error / small.error), order, order == 2 ? 0.7 : 0.05) << name(method) << damped;
        if (!damped) {
            EXPECT_NEAR(std::log2(large.energy / small.energy), order, 0.05) << name(method);
            EXPECT_LT(std::abs(large.drift), 1e-4) << name(method); // it keeps the energy near its own
        }
    };
    expect_order(0, SolverMethod::symplectic_euler, false, 1);
    expect_order(4, SolverMethod::symplectic_euler, true, 1);
    expect_order(6, SolverMethod::leapfrog, false, 2);
    expect_order(10, SolverMethod::leapfrog, true, 2);
    EXPECT_LT(points[0].error, 2e-3);
    EXPECT_LT(points[6].error, 0.1 * points[0].error); // at the same step
    const TimeStepPoint& implicit_point = points[12];
    EXPECT_EQ(implicit_point.method, SolverMethod::backward_euler);
    EXPECT_LT(implicit_point.drift, -0.1); // it takes energy out
    EXPECT_EQ(time_step_table(points).rows.size(), points.size());
}

} // namespace
} // namespace hybmss::price
