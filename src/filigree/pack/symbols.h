// Symbols in as few bits as their frequencies allow: range asymmetric numeral systems [Duda 2013], four states in turn.
// Frequencies are counted while coding, on both sides alike, so that no tables are stored: a stream of a few hundred
// symbols is as well off as a long one. Integers alone: every machine reads what another wrote. The reader is the
// runtime's.
#pragma once

#define FLG_OF_LIBRARY
#include "runtime/rt_symbols.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// How often each symbol of one context came so far, as shares of 2^14.
class SymbolModel {
public:
    static constexpr unsigned kSymbols = FLG_SYMBOLS, kShareBits = FLG_SHARE_BITS;

    SymbolModel() { flg_shares_begin(&shares); }
    std::uint32_t start(unsigned symbol) const { return shares.starts[symbol]; }
    std::uint32_t share(unsigned symbol) const {
        return std::uint32_t(shares.starts[symbol + 1]) - shares.starts[symbol];
    }
    void count(unsigned symbol) { flg_shares_count(&shares, symbol); }

    flg_shares shares;
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

    unsigned symbol(unsigned context) { return flg_read_symbol(&in_, &models_[context].shares); }
    std::uint32_t bits(unsigned count) { return flg_read_bits(&in_, count); }
    std::uint32_t number(unsigned context) { return flg_read_number(&in_, &models_[context].shares); }
    std::int32_t number_with_sign(unsigned context) { return flg_with_sign(number(context)); }

    bool is_damaged() const { return in_.is_damaged != 0; }
    std::size_t size() const { return size_; } ///< of the stream, bytes

private:
    std::size_t size_ = 0;
    std::vector<SymbolModel> models_;
    flg_symbols in_{};
};

} // namespace filigree
