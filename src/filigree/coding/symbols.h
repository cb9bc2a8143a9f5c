// Symbols in as few bits as their frequencies allow: range asymmetric numeral systems [Duda 2013], four states in turn.
// Frequencies are counted while coding, on both sides alike, so that no tables are stored: a stream of a few hundred
// symbols is as well off as a long one. Integers alone: every machine reads what another wrote.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// How often each symbol of one context came so far, as shares of 2^14.
class SymbolModel {
public:
    static constexpr unsigned kSymbols = 64, kShareBits = 14, kShares = 1u << kShareBits;

    SymbolModel();
    std::uint32_t start(unsigned symbol) const { return starts_[symbol]; }
    std::uint32_t share(unsigned symbol) const { return std::uint32_t(starts_[symbol + 1]) - starts_[symbol]; }
    /// The symbol in whose share it is.
    unsigned at(std::uint32_t place) const {
        unsigned symbol = first_[place >> kCoarse];
        while (starts_[symbol + 1] <= place) ++symbol;
        return symbol;
    }
    void count(unsigned symbol) {
        counts_[symbol] += kStep;
        if (--until_update_ == 0) update();
    }

private:
    static constexpr unsigned kCoarse = 6, kStep = 24, kLongestPause = 2048;
    void update();

    std::array<std::uint16_t, kSymbols + 1> starts_;
    std::array<std::uint8_t, (kShares >> kCoarse)> first_; ///< the symbol at the start of every 64 shares
    std::array<std::uint32_t, kSymbols> counts_;
    unsigned pause_ = 4, until_update_ = 4;
};

class SymbolWriter {
public:
    explicit SymbolWriter(unsigned contexts) : models_(contexts) {}

    /// symbol: below SymbolModel::kSymbols.
    void symbol(unsigned context, unsigned symbol);
    /// The low `count` bits, at most 32, as they are.
    void bits(std::uint32_t value, unsigned count);
    /// Any number, small ones in fewer bits.
    void number(unsigned context, std::uint32_t value);
    /// The same with a sign.
    void number_with_sign(unsigned context, std::int32_t value);

    /// Everything, and a few bytes that say how much it is. What comes then is another stream, with the shares as they
    /// have become.
    std::string finish();
    /// How many bytes finish() would give. Cost O(what was written).
    std::size_t size() const { return SymbolWriter(*this).finish().size(); }

private:
    struct Share {
        std::uint16_t start, share;
    };
    std::vector<SymbolModel> models_;
    std::vector<Share> coded_;
    std::string bits_;
    std::uint64_t pending_ = 0; ///< bits that do not fill a byte yet
    unsigned pending_count_ = 0;
};

/// Reads what a SymbolWriter with as many contexts wrote. Damaged bytes give wrong symbols, and past their end
/// is_damaged().
class SymbolReader {
public:
    SymbolReader(std::string_view stream, unsigned contexts);
    /// Goes on with the writer's next stream.
    void read_next(std::string_view stream);

    unsigned symbol(unsigned context);
    std::uint32_t bits(unsigned count);
    std::uint32_t number(unsigned context);
    std::int32_t number_with_sign(unsigned context);

    bool is_damaged() const { return is_damaged_; }
    std::size_t size() const { return size_; } ///< of the stream, bytes

private:
    std::size_t size_ = 0;
    std::vector<SymbolModel> models_;
    std::array<std::uint32_t, 4> states_{};
    unsigned turn_ = 0;
    std::string_view words_, bits_;
    std::uint64_t pending_ = 0;
    unsigned pending_count_ = 0;
    bool is_damaged_ = false;
};

} // namespace filigree
