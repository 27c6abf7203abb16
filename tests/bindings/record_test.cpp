// Records: the same after a round trip, refused where anything is wrong with them, and able to find a wrong force.

#include "hybmss/hybmss.h"
#include "hybmss/record.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <string>

namespace hybmss {
namespace {

Record sample() {
    Record record;
    record.lattice = Lattice::from_cells(3, 2, 2, 0.1, {1, 1, 0, 1, 0.3f, 1, 1, 1, 1, 0, 1, 1});
    record.material = {.young_modulus = 12345.678,
                       .poisson_ratio = 0.1,
                       .volume_energy = VolumeEnergy::mean_stretch,
                       .stiffening = {0.5, 1.25},
                       .springs = SpringForm::means,
                       .crush = {20, 0.99}};
    const ForcePlan<double> plan(record.lattice, record.material);
    const std::size_t nodes = plan.node_count();
    std::mt19937 engine(7);
    std::uniform_real_distribution<double> uniform(-0.005, 0.005);
    for (int s = 0; s < 2; ++s) {
        RecordedState state;
        state.time = 0.1 * s;
        state.displacements.resize(nodes);
        state.forces.assign(nodes, {0, 0, 0});
        for (auto& u : state.displacements) {
            u = {uniform(engine), uniform(engine), uniform(engine)};
        }
        const auto u = VectorField<const double>::aos(state.displacements[0].data(), nodes);
        plan.add_forces(u, VectorField<double>::aos(state.forces[0].data(), nodes));
        state.energy = plan.energy(u);
        state.force_scale = 100;
        record.states.push_back(state);
    }
    return record;
}

VectorField<const double> field(const std::vector<std::array<double, 3>>& vectors) {
    return VectorField<const double>::aos(vectors[0].data(), vectors.size());
}

TEST(Record, IsTheSameAfterARoundTrip) {
    const Record before = sample(), after = parse_record(record_text(before), "sample");
    EXPECT_EQ(after.lattice.cells(), before.lattice.cells());
    EXPECT_TRUE(std::equal(before.lattice.cell_scales().begin(), before.lattice.cell_scales().end(),
                           after.lattice.cell_scales().begin()));
    EXPECT_EQ(after.material.young_modulus, before.material.young_modulus);
    EXPECT_EQ(after.material.volume_energy, before.material.volume_energy);
    EXPECT_EQ(after.material.stiffening.quadratic, 0.5);
    EXPECT_EQ(after.material.stiffening.cubic, 1.25);
    EXPECT_EQ(after.material.springs, SpringForm::means);
    EXPECT_EQ(after.material.crush, before.material.crush);
    ASSERT_EQ(after.states.size(), 2u);
    for (std::size_t s = 0; s < 2; ++s) {
        EXPECT_EQ(after.states[s].displacements, before.states[s].displacements);
        EXPECT_EQ(after.states[s].forces, before.states[s].forces);
        EXPECT_EQ(after.states[s].energy.volume, before.states[s].energy.volume);
        EXPECT_EQ(compare_forces(after, s, field(before.states[s].forces)).error, 0);
    }
    Record box;
    box.lattice = Lattice::box(2, 3, 4, 0.25);
    EXPECT_EQ(parse_record(record_text(box), "box").lattice.cell_count(), 24u);
}

TEST(Record, FindsAWrongForceAndEnergy) {
    const Record record = sample();
    auto forces = record.states[1].forces;
    forces[3][2] += 100 * 2e-11;
    const RecordDifference difference = compare_forces(record, 1, field(forces));
    EXPECT_FALSE(difference.within());
    EXPECT_EQ(difference.node, 3u);
    EXPECT_NEAR(difference.error, 2e-11, 1e-13);
    forces[3][2] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(compare_forces(record, 1, field(forces)).within());

    PotentialEnergy energy = record.states[0].energy;
    EXPECT_TRUE(compare_energy<double>(record, 0, energy).within());
    energy.springs *= 1 + 1e-6;
    EXPECT_FALSE(compare_energy<double>(record, 0, energy).within());
    EXPECT_TRUE(compare_energy<float>(record, 0, energy).within());
    EXPECT_THROW(compare_energy<float>(record, 2, energy), std::invalid_argument);
    forces.pop_back();
    EXPECT_THROW(compare_forces(record, 0, field(forces)), std::invalid_argument);
}

std::string refusal(const std::string& text) {
    try {
        parse_record(text, "it");
    } catch (const RecordError& error) {
        return error.what();
    }
    return "accepted";
}

/// The text with one word replaced, and a checksum that fits again.
std::string with(const std::string& from, const std::string& to) {
    std::string text = record_text(sample());
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    text.resize(text.rfind("end "));
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : text) {
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    }
    char sum[17];
    std::snprintf(sum, sizeof sum, "%016llx", static_cast<unsigned long long>(hash));
    return text + "end " + sum + "\n";
}

TEST(Record, DamagedAndForeignOnesAreRefusedInOneLine) {
    const std::string good = record_text(sample());
    EXPECT_EQ(refusal(good), "accepted");
    EXPECT_EQ(refusal(with("library", "library")), "accepted");
    EXPECT_NE(refusal("").find("no record"), std::string::npos);
    EXPECT_NE(refusal("solid cube\n").find("no record"), std::string::npos);
    EXPECT_NE(refusal("hybmss-record 1\n").find("cut short"), std::string::npos);
    for (std::size_t length = 0; length < good.size(); length += 17) {
        EXPECT_NE(refusal(good.substr(0, length)), "accepted") << length;
    }
    for (std::size_t at = 0; at < good.size(); at += 13) {
        std::string bad = good;
        bad[at] = static_cast<char>(bad[at] ^ 4);
        EXPECT_NE(refusal(bad), "accepted") << at;
    }
    EXPECT_EQ(refusal(with("hybmss-record 1", "hybmss-record 2")),
              "it:1: version 2 of the format; this library reads version 1");
    EXPECT_NE(refusal(with("cells 3", "cells 30000")).find("it:5: 12 scales are not one for each cell"),
              std::string::npos);
    EXPECT_NE(refusal(with("cells 3", "cells x")).find("it:3: \"x\" is not a number"), std::string::npos);
    EXPECT_NE(refusal(with("cell_size 0", "cell_size nan")).find("it:4: "), std::string::npos);
    EXPECT_NE(refusal(with("mean-stretch", "linear")).find("\"linear\" is no volume energy"), std::string::npos);
    EXPECT_NE(refusal(with("material 12345", "material -12345")).find("young_modulus"), std::string::npos);
    EXPECT_NE(refusal(with("states 2", "states 3")).find("ends too early"), std::string::npos);
    EXPECT_NE(refusal(with("states 2", "states 1")).find("more than the states announced"), std::string::npos);
    EXPECT_NE(refusal(with("nodes ", "nodes 1")).find("but the cells have"), std::string::npos);
    EXPECT_NE(refusal(with("state 0 100", "state 0 0")).find("scale of the forces"), std::string::npos);
    EXPECT_NE(refusal(with("tolerance ", "tolerance -")).find("tolerance"), std::string::npos);
}

TEST(Record, IsUsableFromC) {
    const Record record = sample();
    const std::string path = testing::TempDir() + "hybmss_record_test.txt";
    std::ofstream(path) << record_text(record);
    hybmss_record* loaded = nullptr;
    EXPECT_EQ(hybmss_record_load("/no/such/file", &loaded), HYBMSS_FILE_ERROR);
    EXPECT_STREQ(hybmss_last_error(), "/no/such/file: cannot be read: No such file or directory");
    const std::string text = record_text(record);
    EXPECT_EQ(hybmss_record_parse(text.data(), text.size() - 2, &loaded), HYBMSS_FILE_ERROR);
    EXPECT_EQ(hybmss_record_parse(nullptr, 1, &loaded), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_parse(text.data(), text.size(), nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(loaded, nullptr);
    ASSERT_EQ(hybmss_record_parse(text.data(), text.size(), &loaded), HYBMSS_OK);
    hybmss_record_destroy(loaded);
    EXPECT_EQ(hybmss_record_load(nullptr, &loaded), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_load(path.c_str(), nullptr), HYBMSS_INVALID_ARGUMENT);
    ASSERT_EQ(hybmss_record_load(path.c_str(), &loaded), HYBMSS_OK);
    std::remove(path.c_str());

    hybmss_body* body = nullptr;
    hybmss_plan* plan = nullptr;
    std::size_t states = 0, nodes = 0;
    ASSERT_EQ(hybmss_record_state_count(loaded, &states), HYBMSS_OK);
    EXPECT_EQ(states, 2u);
    ASSERT_EQ(hybmss_record_body(loaded, &body), HYBMSS_OK);
    ASSERT_EQ(hybmss_body_node_count(body, &nodes), HYBMSS_OK);
    ASSERT_EQ(hybmss_plan_create(body, HYBMSS_FLOAT, nullptr, &plan), HYBMSS_OK);
    std::vector<float> u(3 * nodes), f(3 * nodes);
    const hybmss_field to_u = hybmss_float_field(u.data(), nodes, 3), to_f = hybmss_float_field(f.data(), nodes, 3);
    const hybmss_const_field from_u = hybmss_const_float_field(u.data(), nodes, 3),
                             from_f = hybmss_const_float_field(f.data(), nodes, 3);
    ASSERT_EQ(hybmss_record_displacements(loaded, 1, &to_u), HYBMSS_OK);
    ASSERT_EQ(hybmss_plan_add_forces(plan, &from_u, &to_f), HYBMSS_OK);
    double error = -1, springs = 0, volume = 0;
    EXPECT_EQ(hybmss_record_compare_forces(loaded, 1, &from_f, &error), HYBMSS_OK);
    EXPECT_TRUE(error > 0 && error < 1e-5) << error;
    ASSERT_EQ(hybmss_plan_energy(plan, &from_u, &springs, &volume), HYBMSS_OK);
    EXPECT_EQ(hybmss_record_compare_energy(loaded, 1, HYBMSS_FLOAT, springs, volume, nullptr), HYBMSS_OK);
    EXPECT_EQ(hybmss_record_compare_energy(loaded, 1, HYBMSS_FLOAT, 2 * springs, volume, &error), HYBMSS_MISMATCH);
    f[7] += 1;
    EXPECT_EQ(hybmss_record_compare_forces(loaded, 1, &from_f, nullptr), HYBMSS_MISMATCH);
    EXPECT_NE(std::string(hybmss_last_error()).find("state 1: forces on node 2 differ"), std::string::npos);

    EXPECT_EQ(hybmss_record_compare_forces(loaded, 2, &from_f, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_compare_forces(loaded, 0, nullptr, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_compare_forces(nullptr, 0, &from_f, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_compare_energy(loaded, 0, 5, 0, 0, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_compare_energy(nullptr, 0, HYBMSS_FLOAT, 0, 0, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_displacements(loaded, 2, &to_u), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_displacements(loaded, 0, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_displacements(nullptr, 0, &to_u), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_state_count(loaded, nullptr), HYBMSS_INVALID_ARGUMENT);
    EXPECT_EQ(hybmss_record_body(loaded, nullptr), HYBMSS_INVALID_ARGUMENT);
    hybmss_plan_destroy(plan);
    hybmss_body_destroy(body);
    hybmss_record_destroy(loaded);
    hybmss_record_destroy(nullptr);
}

} // namespace
} // namespace hybmss
