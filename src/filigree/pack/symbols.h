// Symbols in as few bits as their frequencies allow: range asymmetric numeral systems [Duda 2013], four states in turn.
// Frequencies are counted while coding, on both sides alike, so that no tables are stored: a stream of a few hundred
// symbols is as well off as a long one. Integers alone: every machine reads what another wrote.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
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
    void fetch_last_bits(unsigned count);

    std::size_t size_ = 0;
    std::vector<SymbolModel> models_;
    std::array<std::uint32_t, 4> states_{};
    unsigned turn_ = 0;
    const char *word_ = nullptr, *words_end_ = nullptr; ///< what is left of the words
    const char *bit_ = nullptr, *bits_end_ = nullptr;   ///< and of the bytes of plain bits
    std::uint64_t pending_ = 0;
    unsigned pending_count_ = 0;
    bool is_damaged_ = false;
};

static_assert(std::endian::native == std::endian::little, "words and plain bits are copied as the stream has them");

// What decoding does a hundred million times a minute stands here, to be compiled into its loops. Symbols cannot be
// guessed, and neither can branches that depend on them: so there are none but at the streams' ends.

/// States are this to 2^32 - 1; words of 16 bits go in and out.
inline constexpr std::uint32_t kLowestState = 1u << 16;

inline unsigned SymbolReader::symbol(unsigned context) {
    SymbolModel& model = models_[context];
    std::uint32_t& state = states_[turn_++ % 4];
    const std::uint32_t place = state & (SymbolModel::kShares - 1);
    const unsigned symbol = model.at(place);
    const std::uint32_t next = model.share(symbol) * (state >> SymbolModel::kShareBits) + place - model.start(symbol);
    const bool wants_word = next < kLowestState;
    std::uint16_t word = 0;
    if (word_ != words_end_) {
        std::memcpy(&word, word_, sizeof word);
        word_ += wants_word ? sizeof word : 0;
    } else
        is_damaged_ |= wants_word;
    state = wants_word ? next << 16 | word : next;
    model.count(symbol);
    return symbol;
}

inline std::uint32_t SymbolReader::bits(unsigned count) {
    std::uint64_t more = 0;
    if (bits_end_ - bit_ >= std::ptrdiff_t(sizeof more)) { // as many whole bytes as there is room for
        std::memcpy(&more, bit_, sizeof more);
        pending_ |= more << pending_count_;
        bit_ += (63 - pending_count_) / 8;
        pending_count_ |= 56;
    } else
        fetch_last_bits(count);
    const auto value = std::uint32_t(pending_ & ((std::uint64_t{1} << count) - 1));
    pending_ >>= count;
    pending_count_ -= count;
    return value;
}

/// What a symbol of a number stands for: `first` and what `bits` plain bits add to it.
struct NumberSymbol {
    std::uint32_t first, bits;
};
extern const std::array<NumberSymbol, SymbolModel::kSymbols> kNumberSymbols;

inline std::uint32_t SymbolReader::number(unsigned context) {
    const auto [first, count] = kNumberSymbols[symbol(context)];
    return first | bits(count);
}
inline std::int32_t SymbolReader::number_with_sign(unsigned context) {
    const std::uint32_t value = number(context);
    return std::int32_t(value >> 1) ^ -std::int32_t(value & 1);
}

} // namespace filigree
