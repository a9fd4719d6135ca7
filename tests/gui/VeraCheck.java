import java.io.FileInputStream;
import org.verapdf.gf.foundry.VeraGreenfieldFoundryProvider;
import org.verapdf.pdfa.Foundries;
import org.verapdf.pdfa.PDFAParser;
import org.verapdf.pdfa.flavours.PDFAFlavour;
import org.verapdf.pdfa.results.TestAssertion;
import org.verapdf.pdfa.results.ValidationResult;

/** Prints VALID or the failed rules of each file, by veraPDF: VeraCheck FLAVOUR FILE... */
public class VeraCheck {
    public static void main(String[] arguments) throws Exception {
        VeraGreenfieldFoundryProvider.initialise();
        PDFAFlavour flavour = PDFAFlavour.fromString(arguments[0]);
        for (int i = 1; i < arguments.length; i++) {
            try (FileInputStream file = new FileInputStream(arguments[i]);
                    PDFAParser parser = Foundries.defaultInstance().createParser(file, flavour)) {
                ValidationResult found =
                        Foundries.defaultInstance().createValidator(flavour, false).validate(parser);
                StringBuilder said = new StringBuilder(found.isCompliant() ? "VALID" : "INVALID");
                for (TestAssertion one : found.getTestAssertions()) {
                    said.append(" | ").append(one.getRuleId().getClause()).append(' ');
                    said.append(one.getMessage().replace('\n', ' '));
                }
                System.out.println("RESULT " + said);
            }
        }
    }
}
