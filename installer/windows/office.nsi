; The set-up of the office edition. NEVER RUN ON WINDOWS: it was only compiled, with makensis 3.08.
;   makensis -DWHEELHOUSE=FOLDER -DVERSION=TEXT -DOUT=FILE office.nsi
; WHEELHOUSE is the folder that wheelhouse.sh fills. One user, no administrator, no network.
Unicode true
; Wheels are compressed already.
SetCompress off

!ifndef WHEELHOUSE
  !error "Give -DWHEELHOUSE=FOLDER, the folder that wheelhouse.sh has filled."
!endif
!ifndef VERSION
  !error "Give -DVERSION=TEXT."
!endif
!ifndef OUT
  !error "Give -DOUT=FILE, with NEVER-RUN-ON-WINDOWS in its name."
!endif

Name "OCMM office edition ${VERSION} (never run on Windows)"
OutFile "${OUT}"
RequestExecutionLevel user
InstallDir "$LOCALAPPDATA\OCMM"
ShowInstDetails show
Page instfiles
UninstPage uninstConfirm
UninstPage instfiles

!define KEY "Software\Microsoft\Windows\CurrentVersion\Uninstall\OCMM office edition"
!define POWERSHELL "$SYSDIR\WindowsPowerShell\v1.0\powershell.exe"

Section "OCMM"
  SetOutPath "$INSTDIR\packages"
  ; Packages of an earlier version would be a second OCMM in this folder.
  Delete "$INSTDIR\packages\*.whl"
  File "${WHEELHOUSE}/*.*"
  SetOutPath "$INSTDIR"
  nsExec::ExecToLog '"${POWERSHELL}" -NoProfile -NonInteractive -ExecutionPolicy Bypass -File "$INSTDIR\packages\install.ps1" -Target "$INSTDIR\program"'
  Pop $0
  StrCmp $0 "0" +3
    DetailPrint "OCMM was not installed (code $0). The version before stays as it was."
    Abort
  WriteUninstaller "$INSTDIR\uninstall.exe"
  CreateShortcut "$SMPROGRAMS\OCMM.lnk" "$INSTDIR\program\Scripts\pythonw.exe" "-I -m ocmm_gui --start"
  WriteRegStr HKCU "${KEY}" "DisplayName" "OCMM office edition (never run on Windows)"
  WriteRegStr HKCU "${KEY}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKCU "${KEY}" "UninstallString" '"$INSTDIR\uninstall.exe"'
SectionEnd

; Jobs, records and keys are elsewhere, in the profile of the user, and stay.
Section "Uninstall"
  RMDir /r "$INSTDIR\program"
  RMDir /r "$INSTDIR\packages"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  Delete "$SMPROGRAMS\OCMM.lnk"
  DeleteRegKey HKCU "${KEY}"
SectionEnd
