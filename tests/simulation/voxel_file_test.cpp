/// Voxel files: every format, order and endianness gives the same cells; damaged ones say what is wrong.

#include "simulation/geometry/voxel_grid.hpp"
#include "tests/simulation/files.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

namespace hybmss {
namespace {

using namespace test;

constexpr Shape kShape = {4, 3, 5};

void expect_labels(const VoxelGrid& grid) {
    ASSERT_EQ(grid.cells, (std::array<std::int64_t, 3>{4, 3, 5}));
    ASSERT_EQ(grid.labels.size(), 60u);
    std::size_t cell = 0;
    for (int k = 0; k < 5; ++k) {
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 4; ++i, ++cell) {
                EXPECT_EQ(grid.labels[cell], label_at(i, j, k)) << i << " " << j << " " << k;
            }
        }
    }
}

TEST(Npy, array_i_j_k_is_cell_i_j_k_in_every_order_and_type) {
    for (const int version : {1, 2, 3}) {
        for (const Layout layout : {Layout::x_fastest, Layout::z_fastest}) {
            const std::string order = layout == Layout::x_fastest ? "True" : "False";
            for (const auto& [descr, values] : {std::pair{"|u1", Values::uint8}, std::pair{"<f4", Values::little_float},
                                                std::pair{">f4", Values::big_float}}) {
                expect_labels(
                    parse_npy(npy_header(descr, order, "(4, 3, 5)", version) + samples(kShape, layout, values)));
            }
        }
    }
    const VoxelGrid mask = parse_npy(npy_header("|b1", "False", "(1, 1, 2)") + std::string("\x01\x00", 2));
    EXPECT_EQ(mask.labels, (std::vector<std::uint8_t>{1, 0}));
    EXPECT_FALSE(mask.cell_size);
}

TEST(Nrrd, fastest_axis_is_x_in_every_type_and_encoding) {
    const std::string small = samples(kShape, Layout::x_fastest, Values::uint8);
    for (const char* type : {"uchar", "unsigned char", "uint8", "uint8_t"}) {
        expect_labels(parse_nrrd(nrrd_header(type, kShape, "raw") + small));
        expect_labels(parse_nrrd(nrrd_header(type, kShape, "gzip") + gzipped(small)));
    }
    for (const auto& [endian, values] :
         {std::pair{"little", Values::little_float}, std::pair{"big", Values::big_float}}) {
        const std::string floats = samples(kShape, Layout::x_fastest, values);
        const std::string more = std::string("endian: ") + endian + "\n";
        expect_labels(parse_nrrd(nrrd_header("float", kShape, "raw", more) + floats));
        expect_labels(parse_nrrd(nrrd_header("float", kShape, "gz", more) + gzipped(floats)));
    }
    // Two members in a row are one stream.
    expect_labels(
        parse_nrrd(nrrd_header("uchar", kShape, "gzip") + gzipped(small.substr(0, 7)) + gzipped(small.substr(7))));
    EXPECT_FALSE(parse_nrrd(nrrd_header("uchar", kShape, "raw") + small).cell_size);
}

TEST(Nrrd, spacings_tell_the_cell_size) {
    const auto size = [](const std::string& more) {
        return parse_nrrd(nrrd_header("uchar", {1, 1, 1}, "raw", more) + "\x01").cell_size.value_or(0);
    };
    EXPECT_DOUBLE_EQ(size("spacings: 0.5 0.5 0.5\n"), 0.5);
    EXPECT_DOUBLE_EQ(size("spacings: 2 2 2\nunits: \"mm\" \"mm\" \"mm\"\n"), 2e-3);
    EXPECT_DOUBLE_EQ(size("space directions: (-3,0,0) (0,0,3) (0,3,0)\nspace units: \"cm\" \"cm\" \"cm\"\n"), 3e-2);
    EXPECT_DOUBLE_EQ(size("space directions: (3,4,0) (-4,3,0) (0,0,5)\r\n"), 5);
}

/// A NIfTI file, header and data, as a machine of that order writes it.
struct Nifti {
    std::string bytes;
    bool big = false;

    template <class Number>
    Nifti& put(std::size_t place, Number value) {
        std::array<char, sizeof(Number)> raw{};
        std::memcpy(raw.data(), &value, raw.size());
        if (big) {
            std::reverse(raw.begin(), raw.end());
        }
        bytes.resize(std::max(bytes.size(), place + raw.size()), '\0');
        std::copy(raw.begin(), raw.end(), bytes.begin() + static_cast<std::ptrdiff_t>(place));
        return *this;
    }
    /// kShape's labels, less `intercept` and over `slope`.
    template <class Number>
    Nifti& put_labels(std::size_t place, double slope, double intercept) {
        const std::string labels = samples(kShape, Layout::x_fastest, Values::uint8);
        for (std::size_t n = 0; n < labels.size(); ++n) {
            const double value = (static_cast<unsigned char>(labels[n]) - intercept) / slope;
            put(place + n * sizeof(Number), static_cast<Number>(value));
        }
        return *this;
    }
};

/// Version 1, without data, in millimetres.
Nifti nifti(int type, bool big = false, const std::array<float, 3>& spacing = {2, 2, 2}) {
    Nifti file{"", big};
    file.put<std::int32_t>(0, 348).put<std::int16_t>(40, 3);
    for (std::size_t a = 0; a < 3; ++a) {
        file.put<std::int16_t>(42 + 2 * a, static_cast<std::int16_t>(kShape[a])).put<float>(80 + 4 * a, spacing[a]);
    }
    file.put<std::int16_t>(70, static_cast<std::int16_t>(type)).put<float>(108, 352).put<std::int8_t>(123, 2);
    file.put<std::int32_t>(348, 0);
    file.bytes.replace(344, 4, std::string("n+1\0", 4));
    return file;
}

TEST(Nifti, fastest_axis_is_x_in_every_type_order_and_version) {
    for (const bool big : {false, true}) {
        expect_labels(parse_voxels(nifti(2, big).put_labels<std::uint8_t>(352, 1, 0).bytes));
        expect_labels(parse_voxels(nifti(4, big).put_labels<std::int16_t>(352, 1, 0).bytes));
        expect_labels(parse_voxels(nifti(512, big).put_labels<std::uint16_t>(352, 1, 0).bytes));
        expect_labels(parse_voxels(nifti(8, big).put_labels<std::int32_t>(352, 1, 0).bytes));
        expect_labels(parse_voxels(nifti(768, big).put_labels<std::uint32_t>(352, 1, 0).bytes));
        expect_labels(parse_voxels(nifti(16, big).put_labels<float>(352, 1, 0).bytes));
        expect_labels(parse_voxels(nifti(64, big).put_labels<double>(352, 1, 0).bytes));
        const Nifti scaled =
            nifti(4, big).put<float>(112, 0.5F).put<float>(116, -10).put_labels<std::int16_t>(352, 0.5, -10);
        expect_labels(parse_voxels(scaled.bytes));
        expect_labels(parse_voxels(gzipped(scaled.bytes)));
        EXPECT_DOUBLE_EQ(parse_voxels(scaled.bytes).cell_size.value_or(0), 2e-3);

        Nifti second{"", big};
        second.put<std::int32_t>(0, 540).put<std::int16_t>(12, 2).put<std::int64_t>(16, 4).put<std::int64_t>(48, 1);
        for (std::size_t a = 0; a < 3; ++a) {
            second.put<std::int64_t>(24 + 8 * a, kShape[a]).put<double>(112 + 8 * a, a == 2 ? 3 : 1.5);
        }
        second.put<std::int64_t>(168, 544).put<std::int32_t>(500, 1).put<std::int32_t>(540, 0);
        second.bytes.replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
        const VoxelGrid grid = parse_voxels(second.put_labels<std::uint8_t>(544, 1, 0).bytes);
        expect_labels(grid);
        EXPECT_FALSE(grid.cell_size);
        EXPECT_EQ(grid.spacing.value(), (std::array<double, 3>{1.5, 1.5, 3}));
    }
}

TEST(VoxelGrid, cubes_have_the_label_at_their_centre) {
    const VoxelGrid grid = parse_voxels(nifti(2, false, {2, 2, 6}).put_labels<std::uint8_t>(352, 1, 0).bytes);
    const VoxelGrid cubes = resampled(grid, 2e-3);
    EXPECT_EQ(cubes.cells, (std::array<std::int64_t, 3>{4, 3, 15}));
    EXPECT_EQ(cubes.cell_size.value(), 2e-3);
    std::size_t cell = 0;
    for (int k = 0; k < 15; ++k) {
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 4; ++i, ++cell) {
                ASSERT_EQ(cubes.labels[cell], label_at(i, j, k / 3)) << i << " " << j << " " << k;
            }
        }
    }
    const VoxelGrid coarse = resampled(grid, 6e-3);
    EXPECT_EQ(coarse.cells, (std::array<std::int64_t, 3>{1, 1, 5}));
    EXPECT_EQ(coarse.labels[3], label_at(1, 1, 3));
}

struct BadFile {
    const char* name;
    std::string bytes;
    const char* message;
};

void PrintTo(const BadFile& bad, std::ostream* out) {
    *out << bad.name;
}

std::string nrrd(const std::string& more, const std::string& data = "\x01") {
    return nrrd_header("uchar", {1, 1, 1}, "raw", more) + data;
}

const std::string kFloats = samples(kShape, Layout::z_fastest, Values::little_float);
const std::string kGzip = gzipped(std::string(1000, '\x01'));

const BadFile kBadFiles[] = {
    {"NpyHeaderCut", "\x93NUMPY\x01", "it ends within its header"},
    {"NpyHeaderLong", std::string("\x93NUMPY\x01\x00\xff\xff{}", 12), "it ends within its header"},
    {"NpyHeaderHuge", std::string("\x93NUMPY\x02\x00\xff\xff\xff\xff{}", 14), "it ends within its header"},
    {"NpyVersion", std::string("\x93NUMPY\x09\x00\x02\x00{}", 12), "it is of version 9; known are 1 to 3"},
    {"NpyNoShape", std::string("\x93NUMPY\x01\x00\x2a\x00", 10) + "{'descr': '|u1', 'fortran_order': False,} ",
     "its header has no 'shape'"},
    {"NpyCut", npy_header("<f4", "False", "(4, 3, 5)") + kFloats.substr(0, 100),
     "it is cut short: 100 bytes of values; 4 x 3 x 5 of 4 bytes need 240"},
    {"NpyLong", npy(kShape) + "more", "it is too long: 64 bytes of values; 4 x 3 x 5 of 1 byte need 60"},
    {"NpyLyingShape", npy_header("|u1", "False", "(900, 900, 900)") + "\x01",
     "it is cut short: 1 bytes of values; 900 x 900 x 900 of 1 byte need 729000000"},
    {"NpyHugeShape", npy_header("|u1", "False", "(1099511627776, 1099511627776, 1099511627776)") + "\x01",
     "the nodes at most 1e9"},
    {"NpyZeroShape", npy_header("|u1", "False", "(0, 3, 5)"), "its grid is 0 x 3 x 5; each count must be at least 1"},
    {"NpyNegativeShape", npy_header("|u1", "False", "(-4, -3, 5)") + std::string(60, '\x01'), "at least 1"},
    {"NpyTwoAxes", npy_header("|u1", "False", "(60,)"), "its array has 1 axes; a body needs 3"},
    {"NpyFourAxes", npy_header("|u1", "False", "(3, 4, 5, 1)"), "its array has 4 axes; a body needs 3"},
    {"NpyShapeOfTwoLines", npy_header("|u1", "False", "(4, x\ny, 5)"), "its shape holds \"x y\""},
    {"NpyBadShape", npy_header("|u1", "False", "(4, x, 5)"), "its shape holds \"x\""},
    {"NpyDouble", npy_header("<f8", "False", "(4, 3, 5)"),
     "its values are of NumPy's type <f8; allowed are uint8, bool and float32"},
    {"NpyRecord", npy_header("[('a','|u1')]", "False", "(4, 3, 5)"), "allowed are uint8, bool and float32"},
    {"NpyOrder", npy_header("|u1", "Maybe", "(4, 3, 5)"), "its fortran_order is neither True nor False"},
    {"NpyHalf", npy_header("<f4", "False", "(1, 1, 2)") + std::string("\0\0\x80\x3f\0\0\0\x3f", 8),
     "cell (0, 0, 1) holds 0.5; labels are whole numbers from 0 (no cell) to 255"},
    {"NpyNan", npy_header("<f4", "False", "(1, 1, 1)") + std::string("\0\0\xc0\x7f", 4), "cell (0, 0, 0) holds nan"},
    {"NpyNegative", npy_header("<f4", "False", "(1, 1, 1)") + std::string("\0\0\x80\xbf", 4), "holds -1"},
    {"NpyLargeLabel", npy_header("<f4", "False", "(1, 1, 1)") + std::string("\0\0\x80\x43", 4), "holds 256"},
    {"NrrdNoEnd", "NRRD0004\ntype: uchar\n", "no empty line ends its header"},
    {"NrrdNoField", "NRRD0004\nnonsense\n\n", "\"nonsense\" is not a field"},
    {"NrrdNoType", "NRRD0004\ndimension: 3\n\n", "its header has no \"type\""},
    {"NrrdNoEndian", nrrd_header("float", {1, 1, 1}, "raw") + "1234", "its header has no \"endian\""},
    {"NrrdEndian", nrrd_header("float", {1, 1, 1}, "raw", "endian: middle\n") + "1234", "allowed are little and big"},
    {"NrrdShort", nrrd_header("short", {1, 1, 1}, "raw") + "12",
     "\"type: short\" is not supported; allowed are uint8 (uchar) and float"},
    {"NrrdEncoding", nrrd_header("uchar", {1, 1, 1}, "bzip2") + "1", "allowed are raw and gzip"},
    {"NrrdDetached", nrrd("data file: liver.raw\n"), "the data must be in the same file"},
    {"NrrdSkip", nrrd("byte skip: -1\n"), "the data must follow the header"},
    {"NrrdFlat", "NRRD0004\ntype: uchar\ndimension: 2\n\n", "\"dimension: 2\" is not supported; a body needs 3"},
    {"NrrdSizes", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5\nencoding: raw\n\n", "it must hold 3 numbers"},
    {"NrrdHugeSizes", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 99999999999999999999 5\nencoding: raw\n\n",
     "each count must be at least 1"},
    {"NrrdCut", nrrd("", ""), "it is cut short: 0 bytes of values; 1 x 1 x 1 of 1 byte need 1"},
    {"NrrdLong", nrrd("", "12"), "it is too long"},
    {"NrrdNanSpacing", nrrd("spacings: nan nan nan\n"), "three sizes above 0"},
    {"NrrdSheared", nrrd("space directions: (1,0,0) (0.1,1,0) (0,0,1)\n"), "the axes must be at right angles"},
    {"NrrdUnit", nrrd("spacings: 1 1 1\nunits: \"in\" \"in\" \"in\"\n"), "allowed are \"m\""},
    {"NiftiNoHeader", "\x5c\x01", "it has no header"},
    {"NiftiCut", nifti(2).bytes.substr(0, 300), "as NIfTI it is cut short: 300 bytes, its header has 348"},
    {"NiftiPair", nifti(2).put<char>(345, 'i').bytes, "image and header must be in one file"},
    {"NiftiNoNumber", nifti(2).put<std::int32_t>(0, 349).bytes, "its header is of neither 348 nor 540 bytes"},
    {"NiftiComplex", nifti(32).bytes, "data type 32 is not supported; allowed are"},
    {"NiftiShort", nifti(4).put_labels<std::uint8_t>(352, 1, 0).bytes,
     "it is cut short: 60 bytes of values; 4 x 3 x 5 of 2 bytes need 120"},
    {"NiftiTimes", nifti(2).put<std::int16_t>(40, 4).put<std::int16_t>(48, 7).bytes, "4 dimensions is not supported"},
    {"NiftiNegative", nifti(2).put<std::int16_t>(44, -3).bytes, "each count must be at least 1"},
    {"NiftiPlace", nifti(2).put<float>(108, 1e30F).bytes, "data at byte 1e+30 is not supported; it has 352 bytes"},
    {"NiftiNanPlace", nifti(2).put<float>(108, std::nanf("")).bytes, "data at byte nan"},
    {"NiftiSpacing", nifti(2).put<float>(84, 0).put_labels<std::uint8_t>(352, 1, 0).bytes, "all must be above 0"},
    {"NiftiUnit", nifti(2).put<std::int8_t>(123, 5).put_labels<std::uint8_t>(352, 1, 0).bytes, "unit of length 5"},
    {"NiftiHalf", nifti(16).put_labels<float>(352, 2, 0).bytes, "labels are whole numbers"},
    {"NiftiNoGzip", std::string("\x1f\x8b no gzip at all"), "its gzip stream is damaged"},
    {"GzipNone", nrrd_header("uchar", {10, 10, 10}, "gzip"), "its gzip stream is cut short"},
    {"GzipCut", nrrd_header("uchar", {10, 10, 10}, "gzip") + kGzip.substr(0, kGzip.size() - 6), "cut short"},
    {"GzipNoGzip", nrrd_header("uchar", {10, 10, 10}, "gzip") + "no gzip at all",
     "its gzip stream is damaged: incorrect header check"},
    {"GzipWrongSum",
     nrrd_header("uchar", {10, 10, 10}, "gzip") + kGzip.substr(0, kGzip.size() - 8) + std::string(8, '\x01'),
     "its gzip stream is damaged: incorrect data check"},
    {"GzipFewer", nrrd_header("uchar", {10, 10, 20}, "gzip") + kGzip, "it is cut short: 1000 bytes"},
    {"GzipMore", nrrd_header("uchar", {10, 10, 5}, "gzip") + kGzip, "it is too long: 1000 bytes"},
    {"GzipLying", nrrd_header("uchar", {900, 900, 900}, "gzip") + kGzip, "it is cut short: 1000 bytes"},
};

VoxelGrid parse(const std::string& bytes) {
    return bytes[0] == 'N' ? parse_nrrd(bytes) : bytes[0] == '\x93' ? parse_npy(bytes) : parse_nifti(bytes);
}

class BadVoxelFile : public testing::TestWithParam<BadFile> {};

TEST_P(BadVoxelFile, is_told_in_one_line) {
    try {
        parse(GetParam().bytes);
        FAIL() << "accepted";
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find(GetParam().message), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

INSTANTIATE_TEST_SUITE_P(Files, BadVoxelFile, testing::ValuesIn(kBadFiles),
                         [](const auto& file) { return std::string(file.param.name); });

/// Whatever is cut off or changed: read or refused, never anything else.
TEST(VoxelFile, damage_anywhere_is_survived) {
    const unsigned seed = 20260101;
    std::mt19937 random(seed);
    const std::string whole[] = {npy(kShape), nrrd_header("uchar", {10, 10, 10}, "gzip", "spacings: 1 1 1\n") + kGzip};
    int refused = 0;
    for (const std::string& good : whole) {
        for (std::size_t size = 8; size < good.size(); ++size) {
            EXPECT_THROW(parse(good.substr(0, size)), std::runtime_error) << size;
        }
        for (int trial = 0; trial < 2000; ++trial) {
            std::string bytes = good;
            bytes[8 + random() % (bytes.size() - 8)] = static_cast<char>(random());
            try {
                EXPECT_LE(parse(bytes).labels.size(), 5000u);
            } catch (const std::runtime_error&) {
                ++refused;
            }
        }
    }
    EXPECT_GT(refused, 500) << "seed " << seed;
}

} // namespace
} // namespace hybmss
