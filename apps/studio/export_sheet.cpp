#include "export_sheet.h"

#include "panel.h"

#include <QDialog>
#include <QDialogButtonBox>

#include <array>
#include <memory>

namespace filigree::studio {

namespace {

struct FormatChoice {
    const char *extension, *text;
};
constexpr std::array kFormats = {
    FormatChoice{"glb", "GLB: a skin, for viewers and engines"},
    FormatChoice{"pc2", "PC2: positions, for Blender"},
    FormatChoice{"mdd", "MDD: positions, with times"},
    FormatChoice{"usda", "USD: text, for short motions"},
};

constexpr std::array kKeyRates = {0.0, 60.0, 30.0, 15.0, 10.0};

const Field<GlbSettings> kKeys = {
    [](const GlbSettings& settings) { return double(std::ranges::find(kKeyRates, settings.keys) - kKeyRates.begin()); },
    [](GlbSettings& settings, double row) { settings.keys = kKeyRates[std::size_t(row)]; }};

class ExportRows : public Panel {
public:
    ExportRows(Workbench& workbench, QWidget* parent) : Panel("export", workbench, parent) {
        QStringList formats, keys = {"One a frame"};
        for (const FormatChoice& format : kFormats) formats << format.text;
        for (std::size_t k = 1; k < kKeyRates.size(); ++k) keys << QStringLiteral("%1 a second").arg(kKeyRates[k]);
        const OptionsAccess<GlbSettings> glb = {
            [this] { return this->workbench().glb_settings(); },
            [this](const GlbSettings& to, const std::string&) { this->workbench().set_glb_settings(to); }};
        const auto is_glb = [this](const GlbSettings&) { return format_ == 0; };
        QGridLayout* rows = section({});
        choice(rows,
               {"export.format", "Format", "What the motion is written as", [this] { return double(format_); },
                [this](double row) {
                    format_ = std::size_t(row);
                    refresh();
                }},
               formats);
        choice(rows,
               glb.setting("export.keys", "Keys",
                           "Fewer keys make a smaller file. The motion between two keys is a straight line; the error "
                           "is told after the export.",
                           kKeys, is_glb),
               keys);
        check(rows, glb.setting("export.normals", "Normals",
                                "Off: viewers shade flat, which stays right where the surface is stretched",
                                field(&GlbSettings::normals), is_glb));
        check(rows, glb.setting("export.all_levels", "Coarser levels too",
                                "Viewers that know MSFT_lod draw a coarser level when the object is small",
                                field(&GlbSettings::all_levels), is_glb));
        check(rows, glb.setting("export.compress", "Compress",
                                "A smaller file, for viewers that know EXT_meshopt_compression and "
                                "KHR_mesh_quantization",
                                field(&GlbSettings::compress), is_glb));
        check(rows,
              glb.setting("export.six_joints", "Six joints a vertex, for Blender",
                          "The rest shape is then the true one; else its detail is twice as high, which shows only "
                          "while nothing plays. More joints, a larger file",
                          field(&GlbSettings::six_joints), is_glb));
        refresh();
    }

    QString extension() const { return kFormats[format_].extension; }

private:
    std::size_t format_ = 0;
};

} // namespace

QDialog* make_export_sheet(Workbench& workbench, std::function<void(const QString& extension)> go_on, QWidget* parent) {
    auto* sheet = new QDialog(parent);
    sheet->setObjectName("export.sheet");
    sheet->setWindowTitle("Export the animation");
    sheet->setAttribute(Qt::WA_DeleteOnClose);
    auto* rows = new ExportRows(workbench, sheet);
    auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel, sheet);
    QPushButton* next = buttons->addButton("Export…", QDialogButtonBox::AcceptRole);
    next->setObjectName("export.go_on");
    next->setToolTip("Asks for the file's name");
    for (QAbstractButton* button : buttons->buttons()) button->setIcon(QIcon());
    auto* layout = new QVBoxLayout(sheet);
    layout->addWidget(rows);
    layout->addWidget(buttons);
    QObject::connect(buttons, &QDialogButtonBox::accepted, sheet, [sheet, rows, go_on = std::move(go_on)] {
        const QString extension = rows->extension();
        sheet->accept();
        go_on(extension);
    });
    QObject::connect(buttons, &QDialogButtonBox::rejected, sheet, &QDialog::reject);
    sheet->resize(420, 250);
    return sheet;
}

} // namespace filigree::studio
