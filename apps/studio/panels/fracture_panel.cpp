#include "panels/panels.h"

#include "actions.h"
#include "panel.h"
#include "pieces.h"

namespace filigree::studio {
namespace {

constexpr double kMostPieces = 1000;

template <class Value>
Field<PieceOptions> pattern_field(Value FracturePattern::*member) {
    const Field<FracturePattern> inner = field(member);
    return {[=](const PieceOptions& options) { return inner.get(options.pattern); },
            [=](PieceOptions& options, double number) { inner.set(options.pattern, number); }};
}

class FracturePanel : public Panel {
public:
    FracturePanel(Workbench& workbench, const Actions& actions) : Panel("fracture", workbench) {
        add_pieces(actions);
        add_look();
        add_strength(actions);
        connect(&workbench, &Workbench::piece_options_changed, this, &FracturePanel::refresh);
        connect(&workbench, &Workbench::timeline_changed, this, &FracturePanel::refresh);
        refresh();
    }

private:
    void add_pieces(const Actions& actions) {
        const PieceOptions usual;
        const OptionsAccess<PieceOptions> options = {
            [this] { return workbench().piece_options(); },
            [this](const PieceOptions& to, const std::string&) { workbench().set_piece_options(to); }};
        QGridLayout* rows = section("Pieces of this mesh");
        choice(
            rows,
            options.setting("fracture.pattern", "Pattern",
                            "Pieces of about one size; small ones around a corner that was hit; long ones, as of wood; "
                            "rays and rings, as of glass; small here and large there, as of stone",
                            pattern_field(&FracturePattern::kind)),
            {"Even", "Impact", "Slabs", "Radial", "Grains"});
        number(rows,
               options.setting("fracture.pieces", "Pieces", "About so many", pattern_field(&FracturePattern::pieces)),
               {.least = 2, .most = kMostPieces, .decimals = 0, .logarithmic = true, .neutral = 20});
        number(rows,
               options.setting("fracture.clump", "Clump",
                               "Cells that a piece is made of; with more, pieces are knobbly",
                               pattern_field(&FracturePattern::clump)),
               {.least = 1, .most = 20, .step = 1, .decimals = 0, .neutral = double(usual.pattern.clump)});
        number(rows,
               options.setting("fracture.roughness", "Roughness", "Of the cracks: 0 is planes",
                               pattern_field(&FracturePattern::roughness)),
               {.least = 0, .most = 1, .step = 0.05, .decimals = 2, .neutral = usual.pattern.roughness});
        number(rows,
               options.setting("fracture.stretch", "Length",
                               "Slabs: how many times longer along the mesh's longest axis",
                               pattern_field(&FracturePattern::stretch),
                               [](const PieceOptions& of) { return of.pattern.kind == FracturePatternKind::slabs; }),
               {.least = 1, .most = 20, .step = 0.5, .decimals = 1, .neutral = usual.pattern.stretch});
        number(rows,
               options.setting("fracture.seed", "Seed", "Another number, another breakage", field(&PieceOptions::seed)),
               {.least = 1, .most = 100, .step = 1, .decimals = 0, .neutral = double(usual.seed)});
        beside(rows, {new ActionButton("fracture.cut_button", actions.find("fracture.cut"), {}, page()),
                      new ActionButton("fracture.whole_button", actions.find("fracture.whole"), {}, page())});
    }

    void add_look() {
        QGridLayout* rows = section("Look");
        const auto view = view_settings();
        const auto has_pieces = [this](const ViewSettings&) { return state().source && state().source->pieces; };
        number(rows,
               view.setting("fracture.apart", "Apart",
                            "How far the pieces are moved apart to be seen; the body starts whole",
                            field(&ViewSettings::apart), {}, has_pieces),
               {.least = 0, .most = 1, .step = 0.01, .decimals = 2});
        const Field<ViewSettings> colored = {
            [](const ViewSettings& settings) { return double(settings.coloring == &kPieceColors); },
            [](ViewSettings& settings, double on) { settings.coloring = on ? &kPieceColors : &kOwnColors; }};
        check(rows, view.setting("fracture.colored", "Pieces as colours", "Each piece in one of eight colours", colored,
                                 {}, has_pieces));
        none_ = text(rows, "fracture.none", Tone::quiet);
        none_->setText("The mesh is whole. Cut shows where it would break; every vertex stays where and what it is.");
        figures_ = text(rows, "fracture.figures");
        figures_->setTextFormat(Qt::RichText);
    }

    void add_strength(const Actions& actions) {
        QGridLayout* rows = section("Breaking");
        const OptionsAccess<BodySettings> body = {
            [this] { return state().body; },
            [this](const BodySettings& to, const std::string& merge) { workbench().set_body(to, merge); }};
        number(
            rows,
            body.setting("fracture.strength", "Strength",
                         "Stress at which a crack begins, per cent of the body's stiffness: about how far it stretches "
                         "before it breaks",
                         field(static_cast<double BodySettings::*>(&DropOptions::strength), 100)),
            {.least = 0.05, .most = 100, .decimals = 2, .unit = "%", .logarithmic = true});
        beside(rows, {new ActionButton("fracture.drop", actions.find("body.animate"), {}, page())});
        motion_ = text(rows, "fracture.motion", Tone::quiet);
    }

    void refresh() override {
        Panel::refresh();
        const MadePieces* const pieces = state().source ? state().source->pieces.get() : nullptr;
        none_->setVisible(!pieces);
        figures_->setText(pieces ? pieces_table(*pieces) : QString());
        figures_->setVisible(pieces);
        motion_->setText(motion());
        motion_->setVisible(!motion_->text().isEmpty());
    }

    /// What the body's pieces do.
    QString motion() const {
        const auto made = workbench().playback().made();
        const Moment* const moment = workbench().playback().moment();
        if (!made || !made->fracture || !moment) return {};
        const FractureReport& fracture = moment->fracture;
        if (fracture.broken_area == 0) return QStringLiteral("The body holds. Let it fall, or pull it.");
        return QStringLiteral("%1 of %2 hang on their own; %3 % of the cracks are open.")
            .arg(with_commas(fracture.parts), counted(fracture.pieces, "piece", "pieces"),
                 QString::number(100 * fracture.broken_area / fracture.crack_area, 'f', 0));
    }

    Text *none_, *figures_, *motion_;
};

} // namespace

QWidget* make_fracture_panel(Workbench& workbench, const Actions& actions) {
    return new FracturePanel(workbench, actions);
}

} // namespace filigree::studio
