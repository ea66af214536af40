"""Style sheet of report.html: on screens, on phones and on paper."""

STYLE = """
*{box-sizing:border-box}
body{font:15px/1.45 system-ui,"DejaVu Sans",sans-serif;color:#222;max-width:1120px;margin:10px auto;padding:0 16px}
h1{font-size:15px;font-weight:400;color:#555;margin:0 0 6px;overflow-wrap:anywhere}
h2{font-size:16px;margin:22px 0 6px;border-bottom:1px solid #ddd}
.verdict{display:inline-block;padding:2px 12px;border-radius:4px;color:#fff;font-weight:600;font-size:17px}
.named,.none{background:#2a7f49}.partly,.ambiguous{background:#9a6200}.unknown{background:#b2382a}
.insufficient{background:#5c5c5c}.meaning{color:#555;margin-left:8px}
.explain{font-size:13px;color:#555;margin:4px 0}
.lead{font-size:18px;line-height:1.4;margin:6px 0 8px;overflow-wrap:anywhere}
.cards,.row{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(300px,100%),1fr));gap:12px}
.row{grid-template-columns:repeat(auto-fit,minmax(min(440px,100%),1fr));margin-top:14px}
.card{border:1px solid #ddd;border-radius:6px;padding:8px 12px}
.card h3{font-size:12px;letter-spacing:.04em;text-transform:uppercase;color:#555;margin:0 0 4px}
.card p{margin:2px 0}.big{font-size:20px;font-weight:600}
svg{max-width:100%;height:auto;display:block}figure{margin:0}figcaption{font-size:13px;color:#555}
.table{overflow-x:auto}table{border-collapse:collapse;font-size:14px}
td,th{padding:3px 14px 3px 0;text-align:left;vertical-align:top;overflow-wrap:break-word}
th{font-weight:600;border-bottom:1px solid #bbb;overflow-wrap:normal}
code{background:#f3f3f3;padding:1px 4px;overflow-wrap:anywhere}
.warn{color:#b2382a}.caution{border-left:4px solid #b2382a;background:#fbf1ef;padding:4px 12px;margin:12px 0}
.caution ul{margin:2px 0;padding-left:18px}.small{font-size:13px;color:#555;font-weight:400}ul{padding-left:22px}
.overview{columns:400px 2;column-gap:28px}.overview section{break-inside:avoid;padding:6px 0 10px}
.overview ul{margin:6px 0}.overview h2{margin-top:0}.overview p{margin:6px 0}
.bars{list-style:none;padding:0;margin:8px 0}
.bars li{display:grid;grid-template-columns:minmax(0,5fr) minmax(0,6fr) 62px;gap:10px;align-items:center;padding:3px 0}
.track{background:#f1f1f1;height:18px}.track span{display:block;height:100%;background:#a9b7c4}
.said .track span{background:#1f6fb2}.bars b{text-align:right;font-weight:400;white-space:nowrap}
.said b,.said>span{font-weight:600}
.heat{font-size:13px}.heat td{width:34px;min-width:24px;height:26px;padding:0;text-align:center;vertical-align:middle;
border:1px solid #fff;overflow-wrap:normal}.heat .zero{background:#f1f1f1;color:#767676}
.heat th{border:0;font-weight:400;padding:0 6px 0 0;text-align:right;vertical-align:middle}
.heat th[scope=col]{padding:0 0 4px;text-align:center;vertical-align:bottom}
.heat th[scope=row]{position:sticky;left:0;background:#fff}
.heat th span{display:inline-block;writing-mode:vertical-rl;transform:rotate(180deg);text-align:left;max-height:120px;
line-height:1.1}
.layers{display:flex;flex-wrap:wrap;gap:2px 14px;font-size:13px;color:#555;min-height:21px}
.layers label{cursor:pointer}.layers input{margin:0;vertical-align:-1px}.readout{color:#222}
.origin{font-size:13px;color:#555;margin:0 0 6px}.origin strong{font-weight:600}.origin code,.command{font-size:13px}
.origin>span{display:inline-block;margin-right:14px;overflow-wrap:anywhere}.scroll{overflow-x:auto}
svg[data-figure]{touch-action:pan-y}
.steps{list-style:none;padding:0}.steps li{margin:6px 0}button{font:inherit;font-size:12px;cursor:pointer}
@media (max-width:600px){.scroll svg{width:820px;max-width:none}}
@media (max-width:420px){.heat{font-size:10.5px}.heat td{width:20px;min-width:20px;height:22px}
.heat th{padding-right:4px}}
@page{size:A4;margin:14mm}
@media print{.layers,button{display:none}.explain,.small,figcaption,.origin,.meaning{font-size:10px}h2{font-size:13px}
body{margin:0;max-width:none;font-size:11px;padding:0}.lead{font-size:14px}h2{break-after:avoid}
figure,section,.card,tr,.caution{break-inside:avoid}.cards{grid-template-columns:repeat(auto-fit,minmax(180px,1fr))}
.row{grid-template-columns:repeat(2,1fr)}table{font-size:10px}*{print-color-adjust:exact}}
"""
