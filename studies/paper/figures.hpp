#pragma once

/// \file
/// What an experiment gives: by the lattice at equilibrium, or by finite elements, run anew or as kept in
/// calculix_results.json; and what Golec et al. 2020 print of it in section 6, where our figures differ, and why.

#include "studies/calculix/problem.hpp"
#include "studies/paper/experiment.hpp"

#include <array>
#include <functional>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss::paper {

/// Which elements, strain and law.
struct ElementChoice {
    calculix::ElementType type = calculix::ElementType::c3d8i;
    calculix::Geometry geometry = calculix::Geometry::nonlinear;
    calculix::Law law = calculix::Law::linear;
};
/// "C3D8I NLGEOM", "C3D20 linear", "C3D8I neo-Hooke".
std::string name(const ElementChoice& choice);

struct Figures {
    std::string failure;      ///< why there is no equilibrium; "" where all is well
    double volume_change = 0; ///< e = |sum V' - sum V| / sum V
    /// N, N m or m: force or torque that the plate exerts, or the mean deflection of a beam's free end; along
    /// response_axis().
    double response = 0;
    /// What the print reads as the response: of a shear the size of the whole force, normal part and all; of a torsion
    /// the sum over the plate's nodes of the arm times the force across the axis; else the response.
    double size = 0;
    std::vector<std::array<double, 3>> pictured; ///< displacements of pictured_nodes(), m
    std::vector<std::array<double, 6>> stresses; ///< Cauchy stress of compared_cells(), Pa: xx, yy, zz, xy, yz, xz
    std::vector<std::array<double, 6>>
        nominal;        ///< likewise of the lattice the symmetric part of the first Piola stress
    double seconds = 0; ///< of the whole solve
    bool good() const { return failure.empty(); }
};

/// The static equilibrium of the lattice, in double. The material's A and volume energy count.
Figures solve_lattice(const Experiment& experiment, const Material& material);
/// The same for one of the paper's variants.
Figures solve_lattice(const Experiment& experiment, Model model);

/// The material with springs by the right-hand forms of (5.12), which hold at nu = 1/4 alone: G = 2E/5 for every nu,
/// and with the volume modulus and energy of the paper.
Material e_form(Material material);
/// The material with these instead of its own moduli: the springs' G and the volume's kappa, Pa.
Material with_moduli(Material material, double shear_modulus, double volume_modulus);

/// The paper's motion: 10,000 steps of 0.001 s, as far as it is told. Not told: the time in which the plates are led
/// (s), and the damping, here by mass (1/s).
struct Motion {
    double led_over = 1, damping = 0;
    std::string failure;            ///< where it diverges
    double least = 0, greatest = 0; ///< printed_quantity() over the last two seconds that the plates rest
};
/// Plates led in 1 s and in 10 s, with no damping and with much.
std::vector<Motion> move_lattice(const Experiment& experiment, const Material& material);

/// By CalculiX; volumes are those of the cells spanned by the corners, as for the lattice. Where the program fails,
/// `failure` says how. Throws std::runtime_error where it is not installed.
Figures solve_finite_elements(const Experiment& experiment, const ElementChoice& choice);

/// The mean distance between two sets of pictured nodes, m. Same size.
double mean_distance(const Figures& a, const Figures& b);

/// How far stresses lie from others, over the latter: the square root of the sums of squares over cells and over the
/// nine components of the tensors. Same size.
double stress_distance(const std::vector<std::array<double, 6>>& a, const std::vector<std::array<double, 6>>& of);

/// CalculiX's answers by experiment. Not for concurrent use.
class FiniteElements {
public:
    enum class Source {
        stored, ///< what calculix_results.json held when this program was built
        program ///< ccx, each experiment at most once
    };
    /// Throws std::runtime_error for Source::program where ccx is not installed, and where the kept results cannot be
    /// read.
    explicit FiniteElements(Source source);

    /// A stored experiment that is not there has `failure` set.
    const Figures& figures(const Experiment& experiment, const ElementChoice& choice = {});

    /// "CalculiX 2.20, results kept with this program" or "CalculiX 2.20".
    std::string description() const;
    Source source() const { return source_; }
    /// Everything asked for, as calculix_results.json holds it.
    void write(std::ostream& out) const;

    /// Called with the key of each run before it begins; may be empty.
    std::function<void(const std::string&)> before_run;

private:
    Source source_;
    std::string version_;
    std::map<std::string, Figures> known_;
};

/// The file's text, as it was when this program was built.
extern const std::string_view kStoredFiniteElements;

// ---- the print

/// One line of figures: e in percent (Tables 2 and 3), N (Table 4), N m (Table 5), or the mean distance between HybMSS
/// and FEM in the middle layer in m (text beside Fig. 8 and Fig. 10).
struct PrintedFigures {
    std::optional<double> hybmss_fd, hybmss, finite_elements;
    std::optional<double> of(Model model) const;
};

/// Tables 2 to 5, by kind, nu and "5 %" or "20 %" as printed: a torsion's 1 and 45 degrees.
PrintedFigures printed_figures(const Experiment& experiment);

/// Mean distance from FEM in the middle layer at 20 %, m. Shear or torsion at nu = 0, 0.25 or 0.499.
std::optional<double> printed_distance(const Experiment& experiment);

/// Where a figure of the print comes from, when it is not our equilibrium; each is explained once below a table.
enum class Reason {
    e_form,      ///< the equilibrium of e_form()
    size,        ///< Figures::size
    motion,      ///< within what a Motion swings through
    unexplained, ///< none of these
    law          ///< finite elements: another law at large strain
};
inline constexpr Reason kReasons[] = {Reason::e_form, Reason::size, Reason::motion, Reason::unexplained, Reason::law};

/// Looks for the print's figure (percent, N, N m) in one place after the other; none: the equilibrium `rest` under the
/// print's own energy is it. Two figures agree within 2 % or, of e, within a hundredth of a percent, the print's last
/// digit. e_form and motions are asked only where what came before does not agree.
std::optional<Reason> explain(const Experiment& experiment, double printed, const Figures& rest,
                              const std::function<Figures()>& with_e_form,
                              const std::function<std::vector<Motion>()>& motions);
/// Whether the printed FEM and CalculiX agree likewise.
bool agree(const Experiment& experiment, double printed, double ours);

/// "a"
std::string letter(Reason reason);
/// "a: ...".
std::string explanation(Reason reason);

/// What the print holds: e in percent of a compression or tension, the response of all others.
double printed_quantity(const Experiment& experiment, const Figures& figures);

} // namespace hybmss::paper
