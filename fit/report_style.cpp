#include "fit/report_style.hpp"

namespace kphi::fit {

const char* report_style() {
  return R"(
:root{--ink:#1c2430;--soft:#566071;--rule:#dde2e8;--accent:#d55e00;--blue:#0072b2;--panel:#f6f8fa}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,"DejaVu Sans",sans-serif;
 color:var(--ink);background:#fff;max-width:70rem;margin:0 auto;padding:2.5rem 1.5rem 4rem}
header{border-bottom:3px solid var(--ink);padding-bottom:1rem;margin-bottom:1.5rem}
h1{font-size:1.9rem;line-height:1.2;letter-spacing:-.01em;margin:0 0 .3rem}
h2{font-size:1.25rem;line-height:1.3;margin:2.75rem 0 .8rem;padding-bottom:.3rem;border-bottom:1px solid var(--rule)}
h2.chapter{font-size:1.5rem;border-bottom:3px solid var(--ink);margin-top:4rem}
p{margin:.6rem 0}
p.sub{color:var(--soft);margin:0}
p.lead{font-size:1.1rem;max-width:46rem;margin:0 0 1.4rem}
p.note,figcaption{color:var(--soft);font-size:.88rem;max-width:52rem}
nav{margin:1rem 0;font-size:.95rem}nav a{color:var(--blue);margin-right:1.2rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:1rem}
.card{background:var(--panel);border:1px solid var(--rule);border-top:3px solid var(--blue);border-radius:4px;
 padding:.9rem 1.1rem}
.card h3{margin:0;font-size:.86rem;font-weight:600;color:var(--soft)}
.card .value{font-size:1.02rem;font-weight:650;font-variant-numeric:tabular-nums;margin:.2rem 0;white-space:normal}
.card .value .unit{display:block;font-size:.86rem;font-weight:400;color:var(--soft)}
.card p{margin:0;font-size:.86rem;color:var(--soft);font-variant-numeric:tabular-nums}
figure{margin:1.5rem 0 2rem}
figure svg{display:block;width:100%;max-width:54rem;height:auto;margin:0 auto}
figcaption{margin:.6rem auto 0;max-width:54rem}
figcaption b{color:var(--ink)}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.86rem;line-height:1.4;font-variant-numeric:tabular-nums}
th{text-align:right;font-weight:600;color:var(--soft);border-bottom:2px solid var(--ink);padding:.35rem .6rem;
 vertical-align:bottom}
td{text-align:right;border-bottom:1px solid var(--rule);padding:.32rem .6rem;white-space:nowrap}
tbody tr:nth-child(even){background:#fafbfc}
th.text,td.text{text-align:left;white-space:normal}
td.bad{color:#9c3d00;font-weight:600}
td.hash{text-align:left;font:.68rem/1.4 ui-monospace,"DejaVu Sans Mono",Menlo,monospace;white-space:normal;
 word-break:break-all;color:var(--soft)}
.soft{color:var(--soft)}
.remarks{background:var(--panel);border-left:4px solid var(--accent);padding:.7rem 1.2rem;margin:1.2rem 0}
.remarks h3{margin:0 0 .3rem;font-size:.95rem}.remarks ul{margin:0;padding-left:1.2rem}.remarks li{margin:.15rem 0}
.warning{background:#fff5e9;border-left:4px solid var(--accent);padding:.6rem 1rem}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.3rem 1.4rem;margin:0;font-size:.92rem}
dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
@media (max-width:40rem){dl{grid-template-columns:1fr}dd{margin-bottom:.4rem}}
@page{size:A4;margin:16mm 15mm 18mm}
@media print{body{margin:0;padding:0;max-width:none;font-size:9.5pt}
 .card,figure,tr,.warning,.remarks,.scroll{break-inside:avoid}.scroll.long{break-inside:auto}h2{break-after:avoid}h2.chapter{break-before:page}
 thead{display:table-header-group}.scroll{overflow:visible}table{font-size:7.6pt}th,td{padding:.2rem .35rem}
 .cards{grid-template-columns:repeat(3,1fr);gap:.6rem}.card{padding:.45rem .55rem}.card h3,.card p{font-size:7.8pt}.card .value{font-size:9.2pt;white-space:nowrap}
 figure{margin:.6rem 0 1rem}figure svg{max-width:none;width:78%}nav{display:none}
 *{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
)";
}

}  // namespace kphi::fit
