#include "studies/paper/printed_figures.hpp"
#include "studies/paper/tables.hpp"

#include <fmt/format.h>

namespace hybmss::paper {
namespace {

constexpr double kPoissonRatios[] = {0, 0.25, 0.499};

struct Heading {
    const char* name;
    const char* title;
    const char* unit;     ///< of what the paper prints
    const char* response; ///< that it does not print; nullptr where it is the same
};

Heading heading(Kind kind) {
    switch (kind) {
    case Kind::compression:
        return {"compression", "Table 2: compression", "e %", "N"};
    case Kind::tension:
        return {"tension", "Table 3: tension", "e %", "N"};
    case Kind::shear:
        return {"shear", "Table 4: shear", "N", nullptr};
    default:
        return {"torsion", "Table 5: torsion", "N m", nullptr};
    }
}

std::vector<std::string> introduction(Kind kind) {
    const char* body = kind == Kind::tension ? "A bar of 0.4 x 0.4 x 2.4 m in 4 x 4 x 24 cells"
                                             : "A cube of 5 m in 10 x 10 x 10 cells";
    std::string text = fmt::format("{} between clamped plates, E = 10 kPa. ", body);
    text += kind == Kind::compression || kind == Kind::tension
                ? "e is the relative change of volume, N the force on the plate."
                : "The figure is what the moved plate exerts.";
    if (kind == Kind::torsion) {
        text += " The print says \"5 %\" and \"20 %\" and no angle; 1 degree and 45 degrees come nearest.";
    }
    return {text};
}

Cell cell(std::optional<double> value) {
    return value ? Cell(*value) : Cell();
}

/// Young's modulus and Poisson's ratio with the same G and four times kappa = G (4 nu - 1) / (1 - 2 nu).
Material with_fourfold_volume_modulus(Material material) {
    const double G = shear_modulus(material), r = 4 * volume_modulus(material) / G;
    material.poisson_ratio = (1 + r) / (4 + 2 * r);
    material.young_modulus = 2 * G * (1 + material.poisson_ratio);
    return material;
}

/// A row beside the paper's models.
struct Variant {
    std::string name;
    Material material;
};

std::vector<Variant> variants(const Experiment& experiment) {
    Material material = scene(experiment).material;
    if (experiment.poisson_ratio < 0.25) {
        material.volume_energy = VolumeEnergy::quadratic;
        return {{"(J - 1)^2", material}};
    }
    if (experiment.poisson_ratio > 0.25) {
        return {{"4 kappa", with_fourfold_volume_modulus(material)}};
    }
    return {};
}

class PlateRows {
public:
    PlateRows(Kind kind, TableContext& context, Table& table)
        : context_(context), table_(table), response_too_(heading(kind).response != nullptr) {}

    void add(const Experiment& experiment) {
        const PrintedFigures printed = printed_figures(experiment);
        const Figures& calculix = context_.finite_elements.figures(experiment);
        const Figures& neo_hooke = context_.finite_elements.figures(
            experiment, {.geometry = calculix::Geometry::nonlinear, .law = calculix::Law::neo_hooke});
        const auto row = [&](const std::string& model, std::optional<double> paper, std::optional<double> fem,
                             const Figures& ours, const std::string& remark) {
            std::vector<Cell> cells = {amount_text(experiment), fmt::format("{:g}", experiment.poisson_ratio), model,
                                       cell(paper), cell(fem)};
            for (const Figures* figures : {&ours, &calculix, &neo_hooke}) {
                cells.push_back(figures->good() ? Cell(printed_quantity(experiment, *figures)) : Cell());
            }
            if (response_too_) {
                cells.push_back(ours.good() ? Cell(ours.response) : Cell());
                cells.push_back(calculix.good() ? Cell(calculix.response) : Cell());
            }
            cells.push_back(remark);
            table_.rows.push_back(std::move(cells));
        };
        for (const Model model : kModels) {
            context_.progress(key(experiment) + " " + std::string(name(model)));
            const Figures ours = solve_lattice(experiment, model);
            Difference differs = difference(experiment, model, printed.of(model), ours);
            if (model == Model::hybmss) {
                compare_finite_elements(experiment, printed.finite_elements, calculix, differs);
            }
            reasons_.insert(differs.reasons.begin(), differs.reasons.end());
            row(std::string(name(model)), printed.of(model), printed.finite_elements, ours, differs.text());
        }
        for (const Variant& variant : variants(experiment)) {
            context_.progress(key(experiment) + " " + variant.name);
            const Figures ours = solve_lattice(experiment, variant.material);
            row(variant.name, std::nullopt, std::nullopt, ours, ours.good() ? "" : "no equilibrium");
        }
    }

    const std::set<Reason>& reasons() const { return reasons_; }

private:
    TableContext& context_;
    Table& table_;
    bool response_too_;
    std::set<Reason> reasons_;
};

} // namespace

Table plate_table(Kind kind, TableContext& context) {
    const Heading words = heading(kind);
    const int decimals = words.response ? 3 : 1;
    const auto with_unit = [&](const char* what) { return fmt::format("{}, {}", what, words.unit); };
    Table table{words.name,
                words.title,
                introduction(kind),
                {{"amount", "amount"},
                 {"poisson_ratio", "nu"},
                 {"model", "model"},
                 {"paper_hybmss", with_unit("paper"), words.response ? 2 : 0},
                 {"paper_fem", with_unit("paper FEM"), words.response ? 2 : 0},
                 {"ours", with_unit("ours"), decimals},
                 {"calculix", with_unit("CalculiX"), decimals},
                 {"calculix_neo_hooke", "neo-Hooke", decimals}},
                {},
                {}};
    if (words.response) {
        table.columns.push_back({"ours_force", fmt::format("ours, {}", words.response), 1});
        table.columns.push_back({"calculix_force", fmt::format("CalculiX, {}", words.response), 1});
    }
    table.columns.push_back({"against_print", "against print"});
    PlateRows rows(kind, context, table);
    for (const double amount : kind == Kind::torsion ? std::vector<double>{1, 45} : std::vector<double>{5, 20}) {
        for (const double nu : kPoissonRatios) {
            rows.add({.kind = kind, .amount = amount, .poisson_ratio = nu});
        }
    }
    table.remarks = explanations(rows.reasons());
    return table;
}

} // namespace hybmss::paper
