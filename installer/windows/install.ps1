# Installs the office edition of OCMM from this folder over a Python 3.11 that is there.
# NEVER RUN ON WINDOWS: written from the documentation of PowerShell, pip and venv.
# Nothing is fetched from a network. Jobs, records and keys are never touched.
param(
    [string]$Wheelhouse = $PSScriptRoot,
    [string]$Target = (Join-Path $env:LOCALAPPDATA "OCMM\program")
)
$ErrorActionPreference = "Stop"

function Stop-With([string]$What, [string]$Remedy) {
    [Console]::Error.WriteLine("$What`n$Remedy")
    exit 2
}

function Invoke-Step([string]$What, [string]$Program, [string[]]$Arguments) {
    & $Program @Arguments
    if ($LASTEXITCODE -ne 0) {
        Stop-With "$What failed with code $LASTEXITCODE." "Read the lines above; the version before stays as it was."
    }
}

$launcher = Get-Command py.exe -ErrorAction SilentlyContinue
if ($null -eq $launcher) {
    Stop-With "There is no Python launcher (py.exe)." "Install Python 3.11, 64 bit, with its launcher, then repeat."
}
$bits = & py.exe -3.11 -c "import struct; print(8 * struct.calcsize('P'))"
if ($LASTEXITCODE -ne 0 -or $bits -ne "64") {
    Stop-With "There is no 64-bit Python 3.11." "Install it, then repeat."
}
$lock = Join-Path $Wheelhouse "win_amd64.lock"
$own = @(Get-ChildItem -Path $Wheelhouse -Filter "ocmm-*.whl")
if (-not (Test-Path $lock) -or $own.Count -ne 1) {
    Stop-With "$Wheelhouse is not a complete folder of packages." "Make it again with wheelhouse.sh."
}

# A new version is made beside the one before, which goes only when the new one answers.
$new = "$Target.new"
$before = "$Target.before"
foreach ($left in @($new, $before)) {
    if ((Test-Path $left) -and (Test-Path $Target)) { Remove-Item -Recurse -Force $left }
}
if ((Test-Path $before) -and -not (Test-Path $Target)) { Move-Item $before $Target }
if (Test-Path $new) { Remove-Item -Recurse -Force $new }

Invoke-Step "Making the environment" "py.exe" @("-3.11", "-m", "venv", $new)
$python = Join-Path $new "Scripts\python.exe"
$pip = @("-I", "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-index")
Invoke-Step "Installing the packages" $python ($pip + @("--find-links", $Wheelhouse, "--only-binary", ":all:", "--require-hashes", "-r", $lock))
Invoke-Step "Installing OCMM" $python ($pip + @("--no-deps", $own[0].FullName))
Invoke-Step "Compiling" $python @("-I", "-m", "ocmm_cli", "compile")
Invoke-Step "Asking OCMM for its version" $python @("-I", "-m", "ocmm_cli", "--version")

if (Test-Path $Target) { Move-Item $Target $before }
Move-Item $new $Target
if (Test-Path $before) { Remove-Item -Recurse -Force $before }
Write-Output "OCMM is in $Target. Start the window: $Target\Scripts\python.exe -I -m ocmm_gui --start"
